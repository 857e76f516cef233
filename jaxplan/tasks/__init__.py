"""Tasks: a folder each, with its scene, its expert and its judge."""

"""What the scripts have in common: rows, turns, and the parts of the benchmark."""

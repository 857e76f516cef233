"""Physics in C MuJoCo and a camera: what happens, and what is seen of it."""

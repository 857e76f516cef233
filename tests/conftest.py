"""What all tests share: JAX on the CPU, off-screen rendering, reproducible examples."""

import os

# Set before JAX or MuJoCo is imported; a value from outside wins (for -m gpu).
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MUJOCO_GL", "egl")

from hypothesis import settings

# Compilation makes first examples slow, and the same examples every time make a failure
# belong to the change that caused it.
settings.register_profile("jaxplan", deadline=None, derandomize=True)
settings.load_profile("jaxplan")

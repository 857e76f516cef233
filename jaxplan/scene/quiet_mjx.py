"""`mujoco.mjx`, without the two lines that its import prints where warp is absent."""

import contextlib
import io

with contextlib.redirect_stdout(io.StringIO()):
    from mujoco import mjx

__all__ = ["mjx"]

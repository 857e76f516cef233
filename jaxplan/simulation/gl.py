"""MuJoCo, imported whatever `MUJOCO_GL` says: it matters to those who render only.

MuJoCo reads it when it is imported, and a value that it does not know, or whose library is
missing, makes `import mujoco` fail. So `jaxplan` imports this before anything else.
"""

import contextlib
import importlib
import os
import sys
from typing import Any

chosen = os.environ.get("MUJOCO_GL")
if chosen and "mujoco" not in sys.modules:
    os.environ["MUJOCO_GL"] = "disable"
    try:
        import mujoco
        from mujoco.rendering.classic import gl_context
    finally:
        os.environ["MUJOCO_GL"] = chosen
    # Now as chosen. Where that fails there is no GLContext, and a camera says so.
    with contextlib.suppress(AttributeError, ImportError, OSError, RuntimeError):
        package: Any = mujoco
        package.GLContext = importlib.reload(gl_context).GLContext

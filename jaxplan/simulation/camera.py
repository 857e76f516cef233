"""Offscreen rendering in MuJoCo, with one line of advice where there is no GL."""

import ctypes.util
import os

import mujoco
import numpy as np


class NoGLError(RuntimeError):
    """Rendering is impossible on this machine; the message says what to install."""


def choose_gl() -> None:
    """Picks EGL or OSMesa where no display and no `MUJOCO_GL` is set.

    Raises:
        NoGLError: Neither library is installed.
    """
    if os.environ.get("MUJOCO_GL") or os.environ.get("DISPLAY"):
        return
    for backend, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            os.environ["MUJOCO_GL"] = backend
            return
    raise NoGLError("no OpenGL library for rendering: install libegl1 (or libosmesa6), or set MUJOCO_GL")


class Camera:
    """Renders images of one size.

    Args:
        model: The scene.
        height: Rows [px].
        width: Columns [px].

    Raises:
        NoGLError: No GL library, or it cannot make a context.
    """

    def __init__(self, model: mujoco.MjModel, height: int, width: int) -> None:
        choose_gl()
        try:
            self._renderer = mujoco.Renderer(model, height, width)
        except (mujoco.FatalError, AttributeError, ImportError, RuntimeError) as error:
            raise NoGLError(
                f"cannot render ({error}): install libegl1 and libgl1-mesa-dri (or libosmesa6 with MUJOCO_GL=osmesa)"
            ) from error
        options = mujoco.MjvOption()
        options.geomgroup[:] = 0
        options.geomgroup[[0, 1, 2]] = 1
        self._options = options

    def render(self, data: mujoco.MjData, camera: str) -> np.ndarray:
        """Image (height, width, 3) uint8 from a named camera."""
        self._renderer.update_scene(data, camera, self._options)
        return self._renderer.render()

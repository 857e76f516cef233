"""Offscreen rendering in MuJoCo, with one line of advice where there is no GL."""

import ctypes.util
import importlib
import os
import sys
import weakref
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

import mujoco
import numpy as np
from mujoco.rendering.classic import gl_context

ADVICE = "no OpenGL for rendering: apt install libegl1 libgl1-mesa-dri (or libosmesa6)"


class NoGLError(RuntimeError):
    """Rendering is impossible on this machine; the message says what to install."""


def _use_headless_gl() -> None:
    """Without a display, makes MuJoCo's renderers use EGL, or else OSMesa.

    MuJoCo chooses by `MUJOCO_GL` when it is imported, which is too early for a library to set.
    """
    if (
        os.environ.get("MUJOCO_GL")
        or os.environ.get("DISPLAY")
        or sys.platform != "linux"
    ):
        return
    for name, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            gl_context.GLContext = importlib.import_module(f"mujoco.{name}").GLContext
            return
    raise NoGLError(ADVICE)


class Mark(NamedTuple):
    """A small sphere or cross drawn into a picture."""

    position: np.ndarray
    """(3,) [m]."""
    radius: float
    """[m]."""
    rgba: tuple[float, float, float, float]
    shape: Literal["sphere", "cross"] = "sphere"


class Camera:
    """Renders images of one size.

    Args:
        model: The scene.
        height: Rows [px].
        width: Columns [px].
        groups: Of geoms that are shown.

    Raises:
        NoGLError: No GL library, or it cannot make a context.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        height: int,
        width: int,
        groups: Iterable[int] = (0, 1, 2),
    ) -> None:
        try:
            _use_headless_gl()
            self._renderer = mujoco.Renderer(model, height, width)
        except NoGLError:
            raise
        except (mujoco.FatalError, AttributeError, ImportError, RuntimeError) as error:
            raise NoGLError(f"{ADVICE} ({error})") from error
        # Without this the interpreter takes down EGL before the renderer that needs it.
        weakref.finalize(self, self._renderer.close)
        options = mujoco.MjvOption()
        options.geomgroup[:] = 0
        options.geomgroup[list(groups)] = 1
        self._options = options

    def render(
        self,
        data: mujoco.MjData,
        camera: str | int | mujoco.MjvCamera,
        marks: Sequence[Mark] = (),
    ) -> np.ndarray:
        """Image (height, width, 3) uint8 from a camera, with marks drawn into the scene."""
        self._renderer.update_scene(data, camera, self._options)
        scene = self._renderer.scene
        for mark in marks:
            for kind, size in _geoms(mark):
                if scene.ngeom == scene.maxgeom:
                    break
                mujoco.mjv_initGeom(
                    scene.geoms[scene.ngeom],
                    type=kind,
                    size=size,
                    pos=np.asarray(mark.position, float),
                    mat=np.eye(3).ravel(),
                    rgba=np.asarray(mark.rgba, np.float32),
                )
                scene.ngeom += 1
        return self._renderer.render()


def _geoms(mark: Mark) -> Iterator[tuple[mujoco.mjtGeom, np.ndarray]]:
    """Type and size of the geoms that make a mark: one, or a cross's three bars."""
    if mark.shape == "sphere":
        yield mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, mark.radius)
    else:
        for axis in np.eye(3):
            yield mujoco.mjtGeom.mjGEOM_BOX, mark.radius * np.where(axis, 1, 0.25)

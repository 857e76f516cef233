"""Offscreen rendering in MuJoCo, with one line of advice where there is no GL."""

import atexit
import ctypes.util
import importlib
import os
import sys
import weakref
from collections.abc import Iterable
from itertools import pairwise

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
    if setting := os.environ.get("MUJOCO_GL"):
        if not hasattr(gl_context, "GLContext"):
            raise NoGLError(
                f"MUJOCO_GL={setting} cannot render here: unset it, or set it to egl "
                "(apt install libegl1 libgl1-mesa-dri) or osmesa (apt install libosmesa6)"
            )
        return
    if os.environ.get("DISPLAY") or sys.platform != "linux":
        return
    for name, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if ctypes.util.find_library(library):
            gl_context.GLContext = importlib.import_module(f"mujoco.{name}").GLContext
            return
    raise NoGLError(ADVICE)


def require_gl() -> None:
    """Asks for rendering before the work whose result is to be rendered.

    Raises:
        NoGLError: No GL library, or `MUJOCO_GL` asks for one that is not there.
    """
    Camera(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8)


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
        self._height, self._width = height, width
        try:
            _use_headless_gl()
            self._renderer = mujoco.Renderer(model, height, width)
        except NoGLError:
            raise
        except (mujoco.FatalError, AttributeError, ImportError, RuntimeError) as error:
            raise NoGLError(f"{ADVICE} ({error})") from error
        # At exit before MuJoCo takes down EGL: what is registered last is called first. The
        # finalizers' own turn may have been registered by anybody, long ago.
        atexit.register(weakref.finalize(self, _close, self._renderer))
        options = mujoco.MjvOption()
        options.geomgroup[:] = 0
        options.geomgroup[list(groups)] = 1
        self._options = options
        self._uploaded = model.mesh_vert.copy(), model.tex_data.copy()

    def render(
        self, data: mujoco.MjData, camera: str | int | mujoco.MjvCamera
    ) -> np.ndarray:
        """Image `[height, width, 3]` uint8 from a camera.

        The data may be of another model than the last, with meshes and textures of the same
        sizes.
        """
        self._show(data.model)
        self._renderer.update_scene(data, camera, self._options)
        return self._renderer.render()

    def _show(self, model: mujoco.MjModel) -> None:
        """Draws a model from now on; meshes and textures that are others go to the GPU."""
        renderer, (vertices, texels) = self._renderer, self._uploaded
        renderer._model = model
        if renderer._gl_context:
            renderer._gl_context.make_current()
        for old, new, starts, upload in (
            (vertices, model.mesh_vert, model.mesh_vertadr, mujoco.mjr_uploadMesh),
            (texels, model.tex_data, model.tex_adr, mujoco.mjr_uploadTexture),
        ):
            if np.array_equal(old, new):
                continue
            for i, (a, b) in enumerate(pairwise([*starts, len(new)])):
                if not np.array_equal(old[a:b], new[a:b]):
                    upload(model, renderer._mjr_context, i)
            old[:] = new

    def project(self, points: np.ndarray) -> np.ndarray:
        """Where points `[N, 3]` [m] are in the image that was last rendered, `[N, 2]` [px].

        Column and row, also of what lies behind something; points must be before the camera.
        """
        eyes = self._renderer.scene.camera
        pos, forward, up = (
            np.mean([getattr(eye, field) for eye in eyes], axis=0)
            for field in ("pos", "forward", "up")
        )
        axes = np.stack([np.cross(forward, up), -up, forward])
        x, y, z = axes @ (np.reshape(points, (-1, 3)) - pos).T
        # frustum_top over frustum_near is the tangent of half the field of view
        focal = self._height / 2 * eyes[0].frustum_near / eyes[0].frustum_top
        centre = np.array([self._width, self._height]) / 2
        return centre + focal * np.stack([x / z, y / z], 1)


def _close(renderer: mujoco.Renderer) -> None:
    """Frees a renderer's buffers in its own context, not in that of another camera."""
    if context := renderer._gl_context:
        context.make_current()
    renderer.close()

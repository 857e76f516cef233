"""Videos, and the video of a motion for people."""

import copy
import os
import warnings
from collections.abc import Iterable
from typing import Any

import imageio.v2 as iio
import mujoco
import numpy as np

from jaxplan.simulation.camera import Camera

HEIGHT, WIDTH = 480, 640
FPS = 30
AZIMUTH, ELEVATION = 135.0, -25.0
"""Where the fitting camera looks [deg]."""


def write_video(
    path: str | os.PathLike, frames: Iterable[np.ndarray], fps: int
) -> None:
    """Writes images `[height, width, 3]` uint8 as they come."""
    with warnings.catch_warnings():
        # JAX warns of forks; this one becomes ffmpeg at once.
        warnings.filterwarnings("ignore", "os.fork", RuntimeWarning)
        writer: Any
        with iio.get_writer(str(path), fps=fps, macro_block_size=1) as writer:
            for frame in frames:
                writer.append_data(frame)


def film_motion(
    path: str | os.PathLike, model: mujoco.MjModel, qpos: np.ndarray, fps: int = FPS
) -> None:
    """Renders a motion, from the first camera that stands still or else from one that fits.

    Args:
        path: Of the video.
        model: What moves.
        qpos: `[T, nq]` a row a frame.
        fps: Frames a second.

    Raises:
        NoGLError: No GL library.
    """
    model = copy.copy(model)
    offscreen = model.vis.global_
    offscreen.offwidth = max(offscreen.offwidth, WIDTH)
    offscreen.offheight = max(offscreen.offheight, HEIGHT)
    model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
    data = mujoco.MjData(model)
    # A robot that is only drawn in the groups of its collision geoms is shown in those.
    looks = (0, 1, 2)
    moving = model.body_weldid[model.geom_bodyid] != 0
    drawn = np.isin(model.geom_group[moving], looks).any()
    groups = looks if drawn else range(mujoco.mjNGROUP)

    def pose(row: np.ndarray) -> mujoco.MjData:
        data.qpos[:] = row
        mujoco.mj_forward(model, data)
        return data

    standing = np.flatnonzero(model.cam_bodyid == 0)
    if len(standing):
        view: mujoco.MjvCamera | int = int(standing[0])
    else:
        reach = model.geom_rbound[moving, None]
        places = [pose(row).geom_xpos[moving].copy() for row in qpos]
        low = np.min([place - reach for place in places], (0, 1))
        high = np.max([place + reach for place in places], (0, 1))
        view = fitting_view(low, high, model.vis.global_.fovy)
    camera = Camera(model, HEIGHT, WIDTH, groups)
    write_video(path, (camera.render(pose(row), view) for row in qpos), fps)


def fitting_view(low: np.ndarray, high: np.ndarray, fovy: float) -> mujoco.MjvCamera:
    """A view of the box from `low [3]` to `high [3]` [m], `fovy` high [deg]."""
    view = mujoco.MjvCamera()
    view.lookat[:] = (low + high) / 2
    view.distance = np.linalg.norm(high - low) / 2 / np.sin(np.radians(fovy / 2))
    view.azimuth, view.elevation = AZIMUTH, ELEVATION
    return view

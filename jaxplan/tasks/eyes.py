"""The pictures that a batch of episodes is seen by, as they are or perturbed."""

import copy
from collections.abc import Callable
from functools import cached_property

import mujoco
import numpy as np

from jaxplan.simulation.camera import Camera
from jaxplan.tasks.look import Look
from jaxplan.tasks.perturbation import Drawn, Perturbation, draw

REACH = np.array([[0.36, 0.22], [0.62, 0.36]])
"""Least and greatest x and y of a thing that lies beside what matters [m]."""


class Eyes:
    """One camera, and what its pictures vary by in each lane.

    Args:
        model: Of physics.
        look: Makes what perturbed pictures are taken of, with the model's joints.
        camera: By name.
        image: Rows and columns [px].
        batch: B, how many lanes there are.
        perturbation: What varies.

    Raises:
        ValueError: There is no such camera.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        look: Callable[[], mujoco.MjModel],
        camera: str,
        image: tuple[int, int],
        batch: int,
        perturbation: Perturbation,
    ) -> None:
        cameras = [model.camera(i).name for i in range(model.ncam)]
        if camera not in cameras:
            raise ValueError(f"camera {camera!r}: there is {' or '.join(cameras)}")
        self.name, self.image, self.perturbation = camera, image, perturbation
        self.drawn: list[Drawn | None] = [None] * batch
        """What the last picture of each lane varied by: what a calibration should say."""
        self._model, self._make_look = model, look
        self._camera: Camera | None = None
        self._last: Camera | None = None
        self._seeds, self._queries = np.zeros((2, batch), int)

    @cached_property
    def _look(self) -> Look:
        """Made for the first picture that is perturbed."""
        model = copy.copy(self._make_look())
        # The near plane and the shadows are in units of the model's size, which grows with
        # what waits out of sight.
        model.stat.extent = self._model.stat.extent
        model.stat.center[:] = self._model.stat.center
        return Look(model, self.name, self.image, REACH)

    def begin(self, lane: int, seed: int) -> None:
        """An episode begins."""
        self._seeds[lane], self._queries[lane] = seed, 0

    def picture(self, lane: int, data: mujoco.MjData) -> np.ndarray:
        """`[H, W, 3]` uint8 of a lane's state."""
        if self.perturbation.nothing:
            self.drawn[lane] = None
            if self._camera is None:
                self._camera = Camera(self._model, *self.image)
            self._last = self._camera
            return self._camera.render(data, self.name)
        seed, query = int(self._seeds[lane]), int(self._queries[lane])
        drawn = draw(self.perturbation, seed, query, self._look.materials)
        self._queries[lane], self.drawn[lane] = query + 1, drawn
        picture = self._look.picture(data.qpos, drawn)
        self._last = self._look.camera
        return picture

    def error(self, lane: int) -> np.ndarray:
        """`[5]` how the camera was off its mount in a lane's last picture.

        Yaw, pitch [rad]; right, up, back [m].
        """
        drawn = self.drawn[lane]
        return (
            np.zeros(5) if drawn is None else np.concatenate([drawn.turn, drawn.shift])
        )

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Where points `[N, 3]` [m] are in the picture that was taken last, `[N, 2]` [px]."""
        assert self._last is not None, "no picture was taken yet"
        return self._last.project(points)

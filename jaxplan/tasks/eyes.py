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
        self._own: dict[int, Callable[[], mujoco.MjModel]] = {}
        self._looks: dict[int, Look] = {}
        """Of lanes that look like no other."""
        self._last: Camera | None = None
        self._seeds, self._queries = np.zeros((2, batch), int)

    def give(self, lane: int, look: Callable[[], mujoco.MjModel]) -> None:
        """A lane has a look of its own from now on, with the same joints."""
        self._own[lane] = look
        self._looks.pop(lane, None)

    def begin(self, lane: int, seed: int) -> None:
        """An episode begins."""
        self._seeds[lane], self._queries[lane] = seed, 0

    def picture(self, lane: int, data: mujoco.MjData) -> np.ndarray:
        """`[H, W, 3]` uint8 of a lane's state."""
        if self.perturbation.nothing:
            self.drawn[lane] = None
            self._last = self._plain
            return self._last.render(data, self.name)
        seed, query = int(self._seeds[lane]), int(self._queries[lane])
        look = self._look(lane)
        drawn = draw(self.perturbation, seed, query, look.materials)
        self._queries[lane], self.drawn[lane] = query + 1, drawn
        self._last = self._dressed
        return look.picture(self._last, data.qpos, drawn)

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

    @cached_property
    def _plain(self) -> Camera:
        return Camera(self._model, *self.image)

    @cached_property
    def _dressed(self) -> Camera:
        """Takes the pictures that are perturbed, of whatever lane."""
        return Camera(self._shared.given, *self.image)

    @cached_property
    def _shared(self) -> Look:
        """Of all lanes that have none of their own."""
        return self._made(self._make_look)

    def _look(self, lane: int) -> Look:
        if lane not in self._own:
            return self._shared
        if lane not in self._looks:
            self._looks[lane] = self._made(self._own[lane])
        return self._looks[lane]

    def _made(self, make: Callable[[], mujoco.MjModel]) -> Look:
        model = copy.copy(make())
        # The near plane and the shadows are in units of the model's size, which grows with
        # what waits out of sight.
        model.stat.extent = self._model.stat.extent
        model.stat.center[:] = self._model.stat.center
        return Look(model, self.name, REACH)

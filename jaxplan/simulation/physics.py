"""Physics execution in C MuJoCo: timed trajectories by position control, the gripper by a ramp."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import mujoco
import numpy as np

CONTROL_PERIOD = 0.01
"""Time between two commands to the joints [s]."""


class GripperMotion(NamedTuple):
    """Finger commands [m]: they ramp, since a step topples or misses what it should grasp."""

    open: float = 0.04
    closed: float = -0.035
    release: float = 0.010
    """A release opens each finger by this much; the rest follows once the hand is away."""
    speed: float = 0.05
    """Ramp [m/s]."""
    settle: float = 0.15
    """The arm stands still this long after a motion or a toggle [s]."""


GRIPPER = GripperMotion()


class Simulator:
    """A batch of independent physics episodes of one model, stepped on all cores.

    Each episode is an `MjData`; all of them are stepped by calls that take index lists, so that
    episodes which have ended cost nothing.
    """

    def __init__(self, model: mujoco.MjModel, batch: int, threads: int = 2) -> None:
        self.model = model
        self.data = [mujoco.MjData(model) for _ in range(batch)]
        self._steps = round(CONTROL_PERIOD / model.opt.timestep)
        self._pool = ThreadPoolExecutor(threads)
        self._lag = -model.actuator_biasprm[:7, 2] / model.actuator_gainprm[:7, 0]
        self.record: Callable[[int, mujoco.MjData], None] | None = None
        """Called after each control period with (episode, data), from a worker thread."""

    def q(self, episode: int) -> np.ndarray:
        """Arm joints of an episode, shape (7,) [rad]."""
        return self.data[episode].qpos[:7].copy()

    def fingers(self, episode: int) -> np.ndarray:
        """Finger positions of an episode, shape (2,) [m]."""
        return self.data[episode].qpos[7:9].copy()

    def map(self, function: Callable[[int], object], episodes: Sequence[int]) -> list:
        """`function` of each episode, on all cores."""
        return list(self._pool.map(function, episodes))

    def follow(
        self,
        episodes: Sequence[int],
        trajectories: Sequence[np.ndarray],
        settle: float = GRIPPER.settle,
    ) -> None:
        """Tracks joint trajectories sampled at `CONTROL_PERIOD`, then stands still.

        Args:
            episodes: Indices of the episodes that move.
            trajectories: One array (T, 7) each [rad].
            settle: Time to stand still at the end [s].
        """

        def run(job: tuple[int, np.ndarray]) -> None:
            episode, q = job
            data = self.data[episode]
            # Damping makes a position servo lag by kv / kp: the velocity is fed forward.
            velocity = np.gradient(q, CONTROL_PERIOD, axis=0) if len(q) > 1 else 0.0
            for command in q + self._lag * velocity:
                data.ctrl[:7] = command
                self._advance(episode)
            data.ctrl[:7] = q[-1]
            self._wait(episode, settle)

        list(self._pool.map(run, zip(episodes, trajectories, strict=True)))

    def move_fingers(
        self,
        episodes: Sequence[int],
        targets: Sequence[float],
        settle: float = GRIPPER.settle,
    ) -> None:
        """Ramps both finger commands to `targets` [m] with the arm held still."""

        def run(job: tuple[int, float]) -> None:
            episode, target = job
            data = self.data[episode]
            start = data.ctrl[7:9].copy()
            stride = GRIPPER.speed * CONTROL_PERIOD
            count = int(np.ceil(np.abs(target - start).max() / stride))
            for s in np.linspace(0, 1, count + 1)[1:]:
                data.ctrl[7:9] = start + s * (target - start)
                self._advance(episode)
            self._wait(episode, settle)

        list(self._pool.map(run, zip(episodes, targets, strict=True)))

    def open(self, episodes: Sequence[int], wide: bool = False) -> None:
        """Releases: a little near the object, or all the way (`wide`)."""
        if wide:
            self.move_fingers(episodes, [GRIPPER.open] * len(episodes), settle=0.0)
            return
        fingers = [self.fingers(e).mean() + GRIPPER.release for e in episodes]
        self.move_fingers(episodes, [min(GRIPPER.open, f) for f in fingers])

    def close(self, episodes: Sequence[int]) -> None:
        """Closes on whatever is between the pads; friction holds it."""
        self.move_fingers(episodes, [GRIPPER.closed] * len(episodes))

    def wait(self, episodes: Sequence[int], seconds: float) -> None:
        """Holds every command."""
        self.map(lambda e: self._wait(e, seconds), episodes)

    def _wait(self, episode: int, seconds: float) -> None:
        for _ in range(round(seconds / CONTROL_PERIOD)):
            self._advance(episode)

    def _advance(self, episode: int) -> None:
        mujoco.mj_step(self.model, self.data[episode], self._steps)
        if self.record is not None:
            self.record(episode, self.data[episode])

"""Physics execution in C MuJoCo: timed trajectories by position control, the gripper by a ramp."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np

from jaxplan.robots import Robot

CONTROL_PERIOD = 0.01
"""Time between two commands to the joints [s]."""


class Simulator:
    """A batch of independent physics episodes, stepped on all cores.

    Each episode is an `MjData`; `map` steps some of them side by side, so that episodes which
    have ended cost nothing.
    """

    def __init__(
        self, robot: Robot, model: mujoco.MjModel, batch: int, threads: int = 2
    ) -> None:
        self._gripper = robot.gripper
        self._arm, self._fingers = robot.arm, robot.finger_slice
        self.data = [mujoco.MjData(model) for _ in range(batch)]
        self._steps = round(CONTROL_PERIOD / model.opt.timestep)
        self._pool = ThreadPoolExecutor(threads)
        gain, bias = (
            model.actuator_gainprm[self._arm],
            model.actuator_biasprm[self._arm],
        )
        self._lag = -bias[:, 2] / gain[:, 0]
        self.record: Callable[[int, mujoco.MjData], None] | None = None
        """Called after each control period with (episode, data), from a worker thread."""

    def give(self, episode: int, model: mujoco.MjModel) -> None:
        """Puts another object of the same kind into an episode: a model with the same joints."""
        self.data[episode] = mujoco.MjData(model)

    def q(self, episode: int) -> np.ndarray:
        """Arm joints of an episode, `[d]` [rad]."""
        return self.data[episode].qpos[self._arm].copy()

    def fingers(self, episode: int) -> np.ndarray:
        """Finger positions of an episode, `[fingers]` [m]."""
        return self.data[episode].qpos[self._fingers].copy()

    def map(self, function: Callable[[int], object], episodes: Sequence[int]) -> list:
        """`function` of each episode, on all cores."""
        return list(self._pool.map(function, episodes))

    def follow(self, episode: int, q: np.ndarray, settle: float) -> None:
        """Tracks a joint trajectory sampled at `CONTROL_PERIOD`, then stands still.

        Args:
            episode: Which moves.
            q: `[T, d]` [rad].
            settle: Time to stand still at the end [s].
        """
        data = self.data[episode]
        # Damping makes a position servo lag by kv / kp: the velocity is fed forward.
        velocity = np.gradient(q, CONTROL_PERIOD, axis=0) if len(q) > 1 else 0.0
        for command in q + self._lag * velocity:
            data.ctrl[self._arm] = command
            self._advance(episode)
        data.ctrl[self._arm] = q[-1]
        self.wait(episode, settle)

    def open(self, episode: int) -> None:
        """Releases: opens a little, near the object."""
        finger = self.fingers(episode).mean() + self._gripper.release
        self._move_fingers(
            episode, min(self._gripper.open, finger), self._gripper.settle
        )

    def open_wide(self, episode: int) -> None:
        """Opens all the way."""
        self._move_fingers(episode, self._gripper.open, 0.0)

    def close(self, episode: int) -> None:
        """Closes on whatever is between the pads; friction holds it."""
        self._move_fingers(episode, self._gripper.closed, self._gripper.settle)

    def wait(self, episode: int, seconds: float) -> None:
        """Holds every command."""
        for _ in range(round(seconds / CONTROL_PERIOD)):
            self._advance(episode)

    def _move_fingers(self, episode: int, target: float, settle: float) -> None:
        """Ramps both finger commands to `target` [m] with the arm held still."""
        data = self.data[episode]
        start = data.ctrl[self._fingers].copy()
        stride = self._gripper.speed * CONTROL_PERIOD
        count = int(np.ceil(np.abs(target - start).max() / stride))
        for s in np.linspace(0, 1, count + 1)[1:]:
            data.ctrl[self._fingers] = start + s * (target - start)
            self._advance(episode)
        self.wait(episode, settle)

    def _advance(self, episode: int) -> None:
        data = self.data[episode]
        mujoco.mj_step(data.model, data, self._steps)
        if self.record is not None:
            self.record(episode, data)

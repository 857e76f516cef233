"""Actions at an even pace, where to be a period later and the gripper's mode then, as the loop's.

Between two targets the command goes in a straight line. A gripper that changes its mode does so on
arrival: the arm waits while the fingers move, as it does for whoever else acts.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from jaxplan.base import Action, Observation
from jaxplan.data import FRAME_PERIOD
from jaxplan.robots import Robot
from jaxplan.simulation.physics import CONTROL_PERIOD

TICKS = round(FRAME_PERIOD / CONTROL_PERIOD)
"""Control periods from a frame, or an action, to the next."""
RETREAT_SECONDS = 1.5
"""Of the last motion, which a policy does not decide."""


class DrivenTask(Protocol):
    """What the interface may know of a task beside its observations."""

    batch: int
    robot: Robot

    def in_terminal_region(self, lane: int) -> bool:
        """Whether the joints lie in Q_term."""
        ...

    def retreat(self, lane: int) -> np.ndarray:
        """Joints of a hand that has backed off, `[d]` [rad]."""
        ...


class Step(NamedTuple):
    """One action of each of B lanes."""

    q: np.ndarray
    """`[B, d]` where the arm is to be a period later [rad]."""
    gripper: np.ndarray
    """`[B]` the gripper's mode then: 0 open, 1 closed."""


class Drive:
    """Turns steps into the loop's actions.

    A target outside the joints' limits, or farther than they can go in a period, is clipped, and
    counted in the notes. In the terminal region the hand backs off and the episode is over, as it
    is for Algorithm 1.
    """

    def __init__(self, task: DrivenTask) -> None:
        self._task = task
        self.reset()

    def reset(self) -> None:
        """Begins a batch of episodes."""
        shape = self._task.batch, self._task.robot.dof
        self._commanded = np.full(shape, np.nan)
        """Where the arms were sent last, `[B, d]` [rad]; NaN: not yet."""

    def action(
        self,
        lanes: Sequence[int],
        observation: Observation,
        step: Step,
        notes: Mapping[int, dict[str, Any]] | None = None,
    ) -> Action:
        """What some lanes do in the next period."""
        task = self._task
        blank = observation.q[:0].astype(float)
        q, gripper = [blank] * task.batch, [observation.gripper[:0]] * task.batch
        done, clipped = np.zeros((2, task.batch), int)
        for e in lanes:
            begin = self._commanded[e]
            if np.isnan(begin).any():
                begin = observation.q[e].astype(float)
            mode = observation.gripper[e]
            if task.in_terminal_region(e):
                q[e], done[e] = _eased(begin, task.retreat(e)), True
                gripper[e] = np.full(len(q[e]), mode)
                continue
            target = self._within_limits(begin, step.q[e])
            clipped[e] = not np.allclose(target, step.q[e], atol=1e-6)
            share = np.arange(1, TICKS + 1)[:, None] / TICKS
            q[e] = begin + share * (target - begin)
            gripper[e] = np.full(TICKS, mode)
            gripper[e][-1] = step.gripper[e]
            self._commanded[e] = target
        said = notes or {e: {} for e in lanes}
        return Action(
            q=q,
            gripper=gripper,
            q_toggle=observation.q,
            tolerance=np.inf,
            settle=0.0,
            done=done.astype(bool),
            notes={e: said[e] | {"clipped": int(clipped[e])} for e in lanes},
        )

    def _within_limits(self, begin: np.ndarray, target: np.ndarray) -> np.ndarray:
        """The nearest target that joints can take and reach; they stay where it is not finite."""
        limits = self._task.robot.limits
        farthest = limits.velocity * FRAME_PERIOD
        target = np.where(np.isfinite(target), target, begin)
        target = np.clip(target, begin - farthest, begin + farthest)
        return np.clip(target, limits.q_min, limits.q_max)


def _eased(begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """From standstill to standstill, `[T, d]` [rad]."""
    s = np.linspace(0, 1, round(RETREAT_SECONDS / CONTROL_PERIOD))[:, None]
    return begin + (10 * s**3 - 15 * s**4 + 6 * s**5) * (end - begin)

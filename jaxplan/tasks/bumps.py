"""Collisions: how often the robot hit what stands in the room."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from jaxplan.tasks.tabletop import Tabletop

HARD = 1.0
"""A contact that presses less than this [N] is a touch."""


class Bumps(NamedTuple):
    """What an episode's robot hit: how often, however long each lasted, and how hard [N]."""

    table: int
    others: int
    """The target box, and what else stands there."""
    hardest: float


class BumpWatch:
    """Listens to physics, each control period.

    Args:
        task: Where the episodes run.
    """

    def __init__(self, task: Tabletop) -> None:
        self._task, model = task, task.model
        hand = model.body(task.robot.hand).rootid[0]
        self._robot = model.body_rootid[model.geom_bodyid] == hand
        self._movable = model.body_dofnum[model.geom_bodyid] == 6
        self._table = model.geom_bodyid == 0
        self.begin()

    def begin(self) -> None:
        """A batch of episodes begins."""
        self._count = np.zeros((self._task.batch, 2), int)
        self._hardest = np.zeros(self._task.batch)
        self._touching = np.zeros((self._task.batch, 2), bool)
        self._task.sim.record = self._tick

    def finish(self, lanes: Sequence[int]) -> list[Bumps]:
        """What was hit in some lanes; begins anew."""
        rows = [
            Bumps(int(table), int(others), float(self._hardest[e]))
            for e in lanes
            for table, others in self._count[[e]]
        ]
        self.begin()
        return rows

    def _tick(self, lane: int, data: mujoco.MjData) -> None:
        """The robot against all that neither moves with it nor is to be moved."""
        now = np.zeros(2, bool)
        if data.ncon:
            pair = data.contact.geom
            robot = self._robot[pair]
            fixed = ~robot & ~self._movable[pair]
            for k in np.flatnonzero(robot.any(1) & fixed.any(1)):
                force = np.zeros(6)
                mujoco.mj_contactForce(self._task.model, data, int(k), force)
                if force[0] > HARD:
                    now[0 if self._table[pair[k]].any() else 1] = True
                    self._hardest[lane] = max(self._hardest[lane], force[0])
        self._count[lane] += now & ~self._touching[lane]
        self._touching[lane] = now

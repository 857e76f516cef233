"""Recorded actions once more, through the interface of policies: what it costs by itself."""

from collections.abc import Sequence

import numpy as np

from jaxplan.base import Action, Observation
from jaxplan.data import TimedShard
from jaxplan.policies.drive import Drive, DrivenTask, Step


class Replay:
    """An agent that does in each episode what the expert did in the one of the same seed.

    Args:
        task: Whose arms it moves.
        shard: Demonstrations of all seeds that it will be asked for.
    """

    def __init__(self, task: DrivenTask, shard: TimedShard) -> None:
        self._shard, self._drive = shard, Drive(task)
        self._lanes = task.batch

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch of episodes."""
        self._drive.reset()
        self._rows = [np.flatnonzero(self._shard.seed == seed) for seed in seeds]

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """The action of the frame with this number; after the last one the arm stands still."""
        q, gripper = observation.q.astype(float), observation.gripper.copy()
        for e in lanes:
            if len(rows := self._rows[e]):
                row = rows[min(number, len(rows) - 1)]
                q[e] = self._shard.action_q[row]
                gripper[e] = self._shard.action_gripper[row]
        return self._drive.action(lanes, observation, Step(q, gripper))

    def obstacle(self, lane: int) -> str:
        """Why an arm stands still."""
        return "the demonstration is over"

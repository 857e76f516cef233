"""Relabelled closed-loop states (DAgger): the networks drive, the expert labels what they met."""

from collections.abc import Sequence

import numpy as np

from jaxplan.base import Keyframes, Phase
from jaxplan.data import NO_PATH, PATH_POINTS, Shard, as_shard
from jaxplan.demonstrations.recorder import FRAME, columns, episode_columns
from jaxplan.episodes import EpisodeRecord
from jaxplan.tasks import Tabletop

PASSED = 0.12
"""An arm this near to a keyframe [rad] goes on to the next one."""
WORST_ERROR = 0.01
"""Labels whose inverse kinematics left more than this [m + rad] are not kept."""


class Relabeler:
    """Listens to Algorithm 1 and keeps each phase's start with the expert's labels."""

    def __init__(self, task: Tabletop, seeds: Sequence[int]) -> None:
        self._task, self._seeds = task, seeds
        self._stage: dict[int, tuple[Keyframes, int]] = {}
        self._frames: list[dict] = []

    def __call__(self, phase: Phase) -> None:
        """Keeps the frames of a round."""
        seen, decision = phase.observation, phase.action.decision
        for e in phase.lanes:
            dropped = self._task.closed[e] and not self._task.held(e)
            if e in decision.leaving + decision.backing or dropped:
                continue
            keyframes, following = self._follow(e, seen.q[e])
            if keyframes.error > WORST_ERROR:
                continue
            values = (
                seen.images[self._task.camera][e],
                seen.q[e],
                seen.gripper[e],
                keyframes.q[-1],
                keyframes.gripper_toggle,
                keyframes.q[following],
                keyframes.toggle,
                self._seeds[e],
                self._task.eyes.error(e),
            )
            self._frames.append(dict(zip(FRAME, values, strict=True)))

    def _follow(self, lane: int, q: np.ndarray) -> tuple[Keyframes, int]:
        """The present keyframes, and which of them comes next."""
        keyframes = self._task.keyframes(lane, q)
        before, following = self._stage.get(lane, (None, 0))
        if before is None or before.toggle != keyframes.toggle:
            following = 0
        else:
            # Lift and retreat are relative to where the stage began.
            relative = len(before.q) - min(3, len(keyframes.q))
            if self._task.closed[lane]:
                keyframes.q[0] = before.q[0]
            elif len(before.q) > len(keyframes.q):
                keyframes = keyframes._replace(
                    q=np.concatenate([before.q[:relative], keyframes.q])
                )
        near = np.linalg.norm(keyframes.q - q.astype(float), axis=1) < PASSED
        passed = np.flatnonzero(near[:-1])
        if len(passed):
            following = max(following, int(passed[-1]) + 1)
        self._stage[lane] = (keyframes, following)
        return keyframes, following

    def shard(self, records: Sequence[EpisodeRecord]) -> Shard:
        """All frames, whether or not their episode succeeded; none has a path."""
        count, joints = len(self._frames), self._task.robot.dof
        return as_shard(
            **columns(self._frames),
            path=np.full(count, NO_PATH),
            arc=np.zeros(count),
            path_q=np.zeros((0, PATH_POINTS, joints)),
            path_length=np.zeros(0),
            **episode_columns(records),
        )

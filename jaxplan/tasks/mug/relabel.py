"""Relabelled closed-loop states (DAgger): the networks drive, the expert labels what they met."""

from collections.abc import Sequence

import numpy as np

from jaxplan.data import NO_PATH, PATH_POINTS, Shard, as_shard
from jaxplan.tasks.mug.demonstrate import FRAME
from jaxplan.tasks.mug.expert import Expert, Keyframes
from jaxplan.tasks.mug.task import MugTask

PASSED = 0.12
"""An arm this near to a keyframe [rad] goes on to the next one."""
WORST_ERROR = 0.01
"""Labels whose inverse kinematics left more than this [m + rad] are not kept."""


class Relabeler:
    """Listens to the outer loop and keeps each phase's start with the expert's labels."""

    def __init__(self, task: MugTask, seeds: Sequence[int]) -> None:
        self._task, self._seeds = task, seeds
        self._expert = Expert(task.model, task.shape)
        self._stage: dict[int, tuple[Keyframes, int]] = {}
        self._frames: list[dict] = []

    def __call__(self, phase) -> None:
        """Keeps the frames of a round."""
        for row, e in enumerate(phase.episodes):
            dropped = self._task.closed[e] and not self._task.held(e)
            if e in phase.leaving + phase.missed or dropped:
                continue
            q = phase.observation.q[row]
            keyframes, following = self._follow(e, q.astype(float))
            if keyframes.error > WORST_ERROR:
                continue
            self._frames.append(
                {
                    "image": phase.observation.image[row],
                    "q": q,
                    "gripper": phase.observation.gripper[row],
                    "q_toggle": keyframes.q[-1],
                    "gripper_toggle": int(not self._task.closed[e]),
                    "q_goal": keyframes.q[following],
                    "toggle": int(keyframes.toggle),
                    "seed": self._seeds[e],
                }
            )

    def _follow(self, episode: int, q: np.ndarray) -> tuple[Keyframes, int]:
        """The present keyframes, and which of them comes next."""
        closed = bool(self._task.closed[episode])
        keyframes = self._expert.keyframes(self._task.mug(episode), q, closed)
        before, following = self._stage.get(episode, (None, 0))
        if before is None or before.toggle != keyframes.toggle:
            following = 0
        else:
            # Lift and retreat are relative to where the stage began.
            relative = len(before.q) - min(3, len(keyframes.q))
            if closed:
                keyframes.q[0] = before.q[0]
            elif len(before.q) > len(keyframes.q):
                keyframes = keyframes._replace(
                    q=np.concatenate([before.q[:relative], keyframes.q])
                )
        near = np.linalg.norm(keyframes.q - q, axis=1) < PASSED
        passed = np.flatnonzero(near[:-1])
        if len(passed):
            following = max(following, int(passed[-1]) + 1)
        self._stage[episode] = (keyframes, following)
        return keyframes, following

    def shard(self, records: Sequence) -> Shard:
        """All frames, whether or not their episode succeeded; none has a path."""
        columns = {name: [frame[name] for frame in self._frames] for name in FRAME}
        count = len(self._frames)
        return as_shard(
            **columns,
            path=np.full(count, NO_PATH),
            arc=np.zeros(count),
            path_q=np.zeros((0, PATH_POINTS, 7)),
            path_length=np.zeros(0),
            episode_seed=[record.seed for record in records],
            episode_success=[record.success for record in records],
            episode_failure=[record.failure or "" for record in records],
        )

"""Whole episodes at an even pace: what a policy would have seen, and what the expert did then.

    tick of the motion [10 ms]   0         10        20        27   (arrived)
    frame                        q[0]      ...       ...       at the toggle
    its action                   q[9]      q[19]     q[26]     q[26], and the gripper toggles

A motion's last frame, of an arm that stands at its toggle, is kept only where the gripper toggles:
of other stops nothing is to be learned but to stop.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxplan.base import Phase
from jaxplan.data import TimedShard, as_timed_shard
from jaxplan.demonstrations.expert import ExpertAgent
from jaxplan.demonstrations.recorder import episode_columns
from jaxplan.episodes import EpisodeRecord
from jaxplan.policies.drive import TICKS
from jaxplan.tasks import Tabletop


class TimedRecorder:
    """Listens to the loop, and to physics between its rounds.

    Pictures are taken when the episodes are over, of those that succeeded.

    Args:
        task: Where the episodes run.
        expert: Who drives them.
        seeds: One an episode.
    """

    def __init__(
        self, task: Tabletop, expert: ExpertAgent, seeds: Sequence[int]
    ) -> None:
        self._task, self._expert, self._seeds = task, expert, seeds
        self._states: list[list[np.ndarray]] = [[] for _ in seeds]
        """Each frame's qpos `[nq]`."""
        self._frames: list[list[dict]] = [[] for _ in seeds]
        """And the columns of its row, without what the state says."""
        self._ticks = np.zeros(len(seeds), int)
        """Since the present motion began."""
        task.sim.record = self._tick

    def __call__(self, phase: Phase) -> None:
        """A motion begins in each of some lanes: its frames are known, but not yet their states."""
        for e in phase.lanes:
            q, gripper = phase.action.q[e], phase.action.gripper[e]
            if not len(q) or self._task.in_terminal_region(e):
                continue
            frames = actions(q, gripper)
            row = {
                "gripper": self._task.closed[e],
                "toggle": self._expert.keyframes(e).toggle,
                "seed": self._seeds[e],
            }
            names = "action_q", "action_gripper"
            self._frames[e] += [
                row | dict(zip(names, frame, strict=True)) for frame in frames
            ]
            self._states[e].append(self._task.sim.data[e].qpos.copy())
            self._ticks[e] = 0

    def shard(self, records: Sequence[EpisodeRecord]) -> TimedShard:
        """The batch's frames in the order of seeds; failed episodes leave only their record."""
        self._task.sim.record = None
        kept = [e for e, record in enumerate(records) if record.success]
        frames = [frame for e in kept for frame in self._frames[e]]
        seen = [self._look(e, qpos) for e in kept for qpos in self._states[e]]
        image, q, error = zip(*seen, strict=True) if seen else ((), (), ())
        names = "gripper", "action_q", "action_gripper", "toggle", "seed"
        return as_timed_shard(
            self._task.robot.dof,
            image=np.array(image, np.uint8),
            q=list(q),
            camera_error=list(error),
            **{name: [frame[name] for frame in frames] for name in names},
            **episode_columns(records),
        )

    def _tick(self, lane: int, data: Any) -> None:
        """A control period has passed."""
        self._ticks[lane] += 1
        due = len(self._states[lane]) < len(self._frames[lane])
        if due and self._ticks[lane] % TICKS == 0:
            self._states[lane].append(data.qpos.copy())

    def _look(self, lane: int, qpos: np.ndarray) -> tuple[np.ndarray, ...]:
        """Picture, joints and the camera's error."""
        task = self._task
        image = task.picture_of(lane, qpos)
        return image, qpos[task.robot.arm], task.eyes.error(lane)


def actions(q: np.ndarray, gripper: np.ndarray) -> list[tuple[np.ndarray, int]]:
    """A motion's actions, one a frame: where to be a period later, and the gripper's mode then.

    Args:
        q: `[T, d]` commands, at the control period [rad]; T = 1 stands still.
        gripper: `[T]` modes; another one at the end toggles.
    """
    last = len(q) - 1
    ends = range(TICKS - 1, last + TICKS, TICKS) if last else ()
    moving = [(q[min(end, last)], int(gripper[0])) for end in ends]
    toggles = gripper[-1] != gripper[0] or last == 0
    return moving + [(q[-1], int(gripper[-1]))] * bool(toggles)

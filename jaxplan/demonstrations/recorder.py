"""What is kept of demonstrations: frames with their labels, and the ways that they lie on.

Beside each phase's start the camera looks from perturbed arms too.
"""

from collections.abc import Sequence

import numpy as np

from jaxplan.base import Phase, Subgoal
from jaxplan.data import PATH_POINTS, Shard, as_shard, resample
from jaxplan.demonstrations.expert import DemonstrationConfig, ExpertAgent
from jaxplan.episodes import EpisodeRecord
from jaxplan.tasks import Tabletop

FRAME = ("image", "q", "gripper", *Subgoal._fields, "toggle", "seed", "camera_error")
"""A shard's columns that each frame fills."""


class Recorder:
    """Listens to the loop and keeps frames with their labels.

    Args:
        task: Where the episodes run.
        expert: Who drives them; its labels are kept.
        seeds: One an episode.
        config: From where else the camera looks.
    """

    def __init__(
        self,
        task: Tabletop,
        expert: ExpertAgent,
        seeds: Sequence[int],
        config: DemonstrationConfig,
    ) -> None:
        self._task, self._expert, self._config = task, expert, config
        self._seeds = seeds
        self._rng = [np.random.default_rng([seed, 2]) for seed in seeds]
        self._frames: list[list[dict]] = [[] for _ in seeds]
        self._paths: list[list[np.ndarray]] = [[] for _ in seeds]

    def __call__(self, phase: Phase) -> None:
        """Keeps a round's frames: its start, arms near it and on the way."""
        config, seen = self._config, phase.observation
        for e in phase.lanes:
            q = phase.action.q[e]
            if len(q) < 2 or self._task.in_terminal_region(e):
                continue
            self._keep(e, seen.images[self._task.camera][e], seen.q[e], q)
            first = self._expert.keyframes(e).toggle == 0
            for _ in range(config.perturbed_first if first else config.perturbed):
                self._keep_beside(e, q, at=0, rejoin=len(q) // 8)
            if first:
                at = int(self._rng[e].uniform(0.1, 0.7) * len(q))
                self._keep_beside(e, q, at, rejoin=at + 1)

    def shard(self, records: Sequence[EpisodeRecord]) -> Shard:
        """The batch's frames in the order of seeds; failed episodes leave only their record."""
        kept = [e for e, record in enumerate(records) if record.success]
        frames = [frame for e in kept for frame in self._frames[e]]
        paths = [resample(path) for e in kept for path in self._paths[e]]
        return as_shard(
            **columns(frames),
            path=np.arange(len(frames)),
            arc=np.zeros(len(frames)),
            path_q=np.reshape(
                [q for q, _ in paths], (-1, PATH_POINTS, self._task.robot.dof)
            ),
            path_length=[length for _, length in paths],
            **episode_columns(records),
        )

    def _keep_beside(self, lane: int, q: np.ndarray, at: int, rejoin: int) -> None:
        """A frame from an arm near `q[at]`, whose way goes on from `q[rejoin]`."""
        noise = self._rng[lane].normal(0, self._config.frame_noise, q.shape[1])
        near = q[at] + noise
        image, joints = self._task.observe_at(lane, near)
        self._keep(lane, image, joints, np.concatenate([near[None], q[rejoin:]]))

    def _keep(
        self, lane: int, image: np.ndarray, joints: np.ndarray, way: np.ndarray
    ) -> None:
        """A frame, its label, and its way `[T, d]` [rad]."""
        label = self._expert.label(lane)
        values = (
            image,
            joints,
            np.uint8(self._task.closed[lane]),
            *label,
            self._expert.keyframes(lane).toggle,
            self._seeds[lane],
            self._task.eyes.error(lane),
        )
        self._frames[lane].append(dict(zip(FRAME, values, strict=True)))
        # A noisy episode was driven beside the label; the sampler learns the way to the label.
        most = way[: max(1, len(way) * 7 // 8)]
        self._paths[lane].append(np.concatenate([most, label.q_goal[None]]))


def columns(frames: Sequence[dict]) -> dict[str, list]:
    """A shard's columns of some frames."""
    return {name: [frame[name] for frame in frames] for name in FRAME}


def episode_columns(records: Sequence[EpisodeRecord]) -> dict[str, list]:
    """A shard's columns of some episodes."""
    return {
        "episode_seed": [record.seed for record in records],
        "episode_success": [record.success for record in records],
        "episode_failure": [record.failure or "" for record in records],
    }

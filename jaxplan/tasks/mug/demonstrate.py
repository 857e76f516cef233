"""Demonstrations: the expert drives the same loop that the networks will, and what it saw is kept.

Half of the episodes visit perturbed keyframes, and beside each phase's start the camera looks from
perturbed arms too, so that the networks know the states that execution will meet. Labels are
always the expert's clean keyframes.
"""

from collections.abc import Sequence

import numpy as np

from jaxplan.config import DemonstrationConfig
from jaxplan.data import PATH_POINTS, Shard, as_shard
from jaxplan.tasks.mug.expert import Expert, Keyframes, Toggle
from jaxplan.tasks.mug.task import MugTask, Observation


class ExpertPolicy:
    """The expert as a predictor: it follows its keyframes one by one.

    Called as the upper network is, with (observation, episodes); answers from privileged state.
    """

    def __init__(
        self, task: MugTask, config: DemonstrationConfig = DemonstrationConfig()
    ) -> None:
        self._task, self._config = task, config
        self._expert = Expert(task.model, task.shape)
        self._keyframes: dict[int, Keyframes] = {}
        self._next: dict[int, int] = {}
        self._rng: dict[int, np.random.Generator] = {}
        self._noisy: dict[int, bool] = {}

    def reset(self, seeds: Sequence[int]) -> None:
        """Forgets the last batch."""
        self._keyframes, self._next = {}, {}
        self._rng = {
            e: np.random.default_rng([seed, 1]) for e, seed in enumerate(seeds)
        }
        self._noisy = {
            e: bool(rng.random() < self._config.noisy_episodes)
            for e, rng in self._rng.items()
        }

    def __call__(self, observation: Observation, episodes: Sequence[int]):
        """(q_toggle, gripper_toggle, q_goal) to drive to: the labels, with a noisy episode's noise."""
        rows = []
        for e, q in zip(episodes, observation.q, strict=True):
            self._advance(e, q)
            label = self.label(e)
            q_toggle, q_goal = label[0].copy(), label[2].copy()
            if self._noisy[e]:
                last = self._next[e] == len(self._keyframes[e].q) - 1
                scale = (
                    self._config.toggle_noise if last else self._config.keyframe_noise
                )
                q_goal += self._rng[e].normal(0, scale, 7)
                q_toggle = q_goal if last else q_toggle
            rows.append((q_toggle, label[1], q_goal))
        q_toggle, gripper_toggle, q_goal = (
            np.array(column) for column in zip(*rows, strict=True)
        )
        return q_toggle, gripper_toggle, q_goal

    def label(self, episode: int) -> tuple[np.ndarray, int, np.ndarray]:
        """Clean (q_toggle, gripper_toggle, q_goal) of the episode's present phase."""
        keyframes = self._keyframes[episode]
        return (
            keyframes.q[-1],
            int(not self._task.closed[episode]),
            keyframes.q[self._next[episode]],
        )

    def toggle(self, episode: int) -> Toggle:
        """Which toggle comes next."""
        return self._keyframes[episode].toggle

    def _advance(self, episode: int, q: np.ndarray) -> None:
        """To the next keyframe, or to a new stage once the gripper has toggled."""
        closed = bool(self._task.closed[episode])
        keyframes = self._keyframes.get(episode)
        if keyframes is not None and (keyframes.toggle % 2 == 1) == closed:
            if self._next[episode] + 1 < len(keyframes.q):
                self._next[episode] += 1
        else:
            self._keyframes[episode] = self._expert.keyframes(
                self._task.mug(episode), q.astype(float), closed
            )
            self._next[episode] = 0


class Recorder:
    """Listens to the loop and keeps frames with their labels."""

    def __init__(
        self,
        task: MugTask,
        policy: ExpertPolicy,
        seeds: Sequence[int],
        config: DemonstrationConfig,
    ) -> None:
        self._task, self._policy, self._seeds, self._config = (
            task,
            policy,
            seeds,
            config,
        )
        self._rng = {
            e: np.random.default_rng([seed, 2]) for e, seed in enumerate(seeds)
        }
        self._frames: dict[int, list[dict]] = {e: [] for e in range(len(seeds))}
        self._paths: dict[int, list[np.ndarray]] = {e: [] for e in range(len(seeds))}

    def __call__(self, phase) -> None:
        """Keeps this round's frames: each phase's start, and arms near it and on its way."""
        for row, e in enumerate(phase.episodes):
            if e not in phase.executed or self._task.in_terminal_region(e):
                continue
            q = phase.motion.q[e]
            observation = Observation(
                *(column[row : row + 1] for column in phase.observation)
            )
            self._keep(e, observation, q)
            first = self._policy.toggle(e) == Toggle.GRASP1
            config = self._config
            for _ in range(config.perturbed_first if first else config.perturbed):
                near = q[0] + self._rng[e].normal(0, config.frame_noise, 7)
                self._keep(
                    e,
                    self._task.observe_at(e, near),
                    np.concatenate([near[None], q[len(q) // 8 :]]),
                )
            if first:
                k = int(self._rng[e].uniform(0.1, 0.7) * len(q))
                near = q[k] + self._rng[e].normal(0, config.frame_noise, 7)
                self._keep(
                    e,
                    self._task.observe_at(e, near),
                    np.concatenate([near[None], q[k + 1 :]]),
                )

    def _keep(self, episode: int, observation: Observation, q: np.ndarray) -> None:
        q_toggle, gripper_toggle, q_goal = self._policy.label(episode)
        self._frames[episode].append({
            "image": observation.image[0], "q": observation.q[0], "gripper": observation.gripper[0],
            "q_toggle": q_toggle, "gripper_toggle": gripper_toggle, "q_goal": q_goal,
            "toggle": int(self._policy.toggle(episode)), "seed": self._seeds[episode],
        })  # fmt: skip
        # A noisy episode was driven beside the label; the sampler learns the way to the label.
        self._paths[episode].append(
            np.concatenate([q[: max(1, len(q) * 7 // 8)], q_goal[None]])
        )

    def shard(self, records: Sequence) -> Shard:
        """The batch's frames in the order of seeds; failed episodes leave only their record."""
        frames, paths = [], []
        for e, record in enumerate(records):
            if record.success:
                frames += self._frames[e]
                paths += self._paths[e]
        resampled = [_resample(path) for path in paths]
        columns = {key: [frame[key] for frame in frames] for key in (
            "image", "q", "gripper", "q_toggle", "gripper_toggle", "q_goal", "toggle", "seed",
        )}  # fmt: skip
        return as_shard(
            **columns,
            path=np.arange(len(frames)), arc=np.zeros(len(frames)),
            path_q=[q for q, _ in resampled], path_length=[length for _, length in resampled],
            episode_seed=[record.seed for record in records],
            episode_success=[record.success for record in records],
            episode_failure=[record.failure or "" for record in records],
        )  # fmt: skip


def _resample(path: np.ndarray) -> tuple[np.ndarray, float]:
    """`PATH_POINTS` points uniform in arc length, and the length [rad]."""
    arc = np.concatenate(
        [[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))]
    )
    at = np.linspace(0, arc[-1], PATH_POINTS)
    return np.stack([np.interp(at, arc, joint) for joint in path.T], 1), float(arc[-1])

"""Demonstrations: the expert drives the same loop that the networks will, and what it saw is kept.

Half of the episodes visit perturbed keyframes, and beside each phase's start the camera looks from
perturbed arms too, so that the networks know the states that execution will meet. Labels are
always the expert's clean keyframes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from jaxplan.config import DemonstrationConfig
from jaxplan.data import PATH_POINTS, Shard, as_shard
from jaxplan.tasks.mug.expert import Expert, Keyframes, Toggle
from jaxplan.tasks.mug.task import MugTask, Observation


class Label(NamedTuple):
    """What the predictor should have said."""

    q_toggle: np.ndarray
    """(7,) [rad]."""
    gripper_toggle: int
    """0 open, 1 closed: the mode after the toggle."""
    q_goal: np.ndarray
    """(7,) [rad]."""


FRAME = (*Observation._fields, *Label._fields, "toggle", "seed")
"""A shard's columns that each frame fills."""


@dataclass
class _Script:
    """How far an episode has come on the expert's way."""

    rng: np.random.Generator
    noisy: bool
    keyframes: Keyframes | None = None
    """To the next toggle; None before the first look."""
    next: int = 0
    """The keyframe that the present phase leads to."""


class ExpertPolicy:
    """The expert as a predictor: it follows its keyframes one by one.

    Called as the upper network is, with (observation, episodes); answers from privileged state.
    """

    def __init__(
        self, task: MugTask, config: DemonstrationConfig = DemonstrationConfig()
    ) -> None:
        self._task, self._config = task, config
        self._expert = Expert(task.model, task.shape)
        self._scripts: list[_Script] = []

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch, one episode per seed; a seed says whether its episode is noisy."""
        self._scripts = []
        for seed in seeds:
            rng = np.random.default_rng([seed, 1])
            noisy = bool(rng.random() < self._config.noisy_episodes)
            self._scripts.append(_Script(rng, noisy))

    def __call__(
        self, observation: Observation, episodes: Sequence[int]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(q_toggle, gripper_toggle, q_goal) to drive to: labels, with a noisy episode's noise."""
        rows = []
        for e, q in zip(episodes, observation.q, strict=True):
            self._advance(e, q)
            rows.append(self._perturbed(e))
        q_toggle, gripper_toggle, q_goal = map(np.array, zip(*rows, strict=True))
        return q_toggle, gripper_toggle, q_goal

    def label(self, episode: int) -> Label:
        """The clean label of the episode's present phase."""
        keyframes = self._keyframes(episode)
        closed = bool(self._task.closed[episode])
        q_goal = keyframes.q[self._scripts[episode].next]
        return Label(keyframes.q[-1], int(not closed), q_goal)

    def toggle(self, episode: int) -> Toggle:
        """Which toggle comes next."""
        return self._keyframes(episode).toggle

    def _keyframes(self, episode: int) -> Keyframes:
        keyframes = self._scripts[episode].keyframes
        assert keyframes is not None, "asked before the episode was observed"
        return keyframes

    def _advance(self, episode: int, q: np.ndarray) -> None:
        """To the next keyframe, or to the next toggle's once the gripper has toggled."""
        script, closed = self._scripts[episode], bool(self._task.closed[episode])
        keyframes = script.keyframes
        if keyframes is None or (keyframes.toggle % 2 == 1) != closed:
            mug = self._task.mug(episode)
            script.keyframes = self._expert.keyframes(mug, q.astype(float), closed)
            script.next = 0
        else:
            script.next = min(script.next + 1, len(keyframes.q) - 1)

    def _perturbed(self, episode: int) -> Label:
        """The label, or in a noisy episode a place beside it."""
        script, label = self._scripts[episode], self.label(episode)
        if not script.noisy:
            return label
        at_toggle = script.next == len(self._keyframes(episode).q) - 1
        config = self._config
        scale = config.toggle_noise if at_toggle else config.keyframe_noise
        q_goal = label.q_goal + script.rng.normal(0, scale, 7)
        return label._replace(
            q_toggle=q_goal if at_toggle else label.q_toggle, q_goal=q_goal
        )


class Recorder:
    """Listens to the loop and keeps frames with their labels.

    Args:
        task: Where the episodes run.
        policy: Who drives them; its labels are kept.
        seeds: One per episode.
        config: From where else the camera looks.
    """

    def __init__(
        self,
        task: MugTask,
        policy: ExpertPolicy,
        seeds: Sequence[int],
        config: DemonstrationConfig,
    ) -> None:
        self._task, self._policy, self._config = task, policy, config
        self._seeds = seeds
        self._rng = [np.random.default_rng([seed, 2]) for seed in seeds]
        self._frames: list[list[dict]] = [[] for _ in seeds]
        self._paths: list[list[np.ndarray]] = [[] for _ in seeds]

    def __call__(self, phase) -> None:
        """Keeps a round's frames (`rollout.Phase`): its start, arms near it and on the way."""
        config = self._config
        for row, e in enumerate(phase.episodes):
            if e not in phase.executed or self._task.in_terminal_region(e):
                continue
            q = phase.motion.q[e]
            self._keep(e, Observation(*(x[[row]] for x in phase.observation)), q)
            first = self._policy.toggle(e) == Toggle.GRASP1
            for _ in range(config.perturbed_first if first else config.perturbed):
                self._keep_beside(e, q, at=0, rejoin=len(q) // 8)
            if first:
                at = int(self._rng[e].uniform(0.1, 0.7) * len(q))
                self._keep_beside(e, q, at, rejoin=at + 1)

    def shard(self, records: Sequence) -> Shard:
        """The batch's frames in the order of seeds; failed episodes leave only their record."""
        kept = [e for e, record in enumerate(records) if record.success]
        frames = [frame for e in kept for frame in self._frames[e]]
        paths = [_resample(path) for e in kept for path in self._paths[e]]
        return as_shard(
            **{name: [frame[name] for frame in frames] for name in FRAME},
            path=np.arange(len(frames)),
            arc=np.zeros(len(frames)),
            path_q=[q for q, _ in paths],
            path_length=[length for _, length in paths],
            episode_seed=[record.seed for record in records],
            episode_success=[record.success for record in records],
            episode_failure=[record.failure or "" for record in records],
        )

    def _keep_beside(self, episode: int, q: np.ndarray, at: int, rejoin: int) -> None:
        """A frame from an arm near `q[at]`, whose way goes on from `q[rejoin]`."""
        near = q[at] + self._rng[episode].normal(0, self._config.frame_noise, 7)
        seen = self._task.observe_at(episode, near)
        self._keep(episode, seen, np.concatenate([near[None], q[rejoin:]]))

    def _keep(self, episode: int, seen: Observation, q: np.ndarray) -> None:
        """A frame (an observation of one arm), its label, and its way `q` (T, 7) [rad]."""
        label = self._policy.label(episode)
        values = (
            *(column[0] for column in seen),
            *label,
            int(self._policy.toggle(episode)),
            self._seeds[episode],
        )
        self._frames[episode].append(dict(zip(FRAME, values, strict=True)))
        # A noisy episode was driven beside the label; the sampler learns the way to the label.
        most = q[: max(1, len(q) * 7 // 8)]
        self._paths[episode].append(np.concatenate([most, label.q_goal[None]]))


def _resample(path: np.ndarray) -> tuple[np.ndarray, float]:
    """`PATH_POINTS` points uniform in arc length, and the length [rad]."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0, arc[-1], PATH_POINTS)
    return np.stack([np.interp(at, arc, joint) for joint in path.T], 1), float(arc[-1])

"""The expert as an agent: Algorithm 1 with the task's keyframes in the networks' place.

Half of the episodes visit perturbed keyframes, so that the networks know the states that
execution will meet. Labels are always the expert's clean keyframes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jaxplan.algorithm1 import Algorithm1, Algorithm1Config
from jaxplan.base import Action, Keyframes, Observation, Subgoal
from jaxplan.motion import MotionPlanner
from jaxplan.ranges import Checked, NotNegative, Probability, Whole
from jaxplan.tasks import Tabletop


@dataclass(frozen=True)
class DemonstrationConfig(Checked):
    """What a demonstration visits and keeps. Noise is a joint's standard deviation [rad]."""

    noisy_episodes: Probability = 0.5
    """Share of episodes whose keyframes are driven to with noise."""
    keyframe_noise: NotNegative = 0.015
    toggle_noise: NotNegative = 0.004
    frame_noise: NotNegative = 0.03
    """Of the arms from which the camera looks beside the phase's start."""
    perturbed_first: Whole = 2
    """Frames from perturbed arms in a phase before the first grasp, where the picture decides."""
    perturbed: Whole = 1
    """The same in later phases."""


CLEAN = DemonstrationConfig(noisy_episodes=0.0)


@dataclass
class _Script:
    """How far an episode has come on the expert's way."""

    rng: np.random.Generator
    noisy: bool
    keyframes: Keyframes | None = None
    """To the next toggle; None before the first look."""
    next: int = 0
    """The keyframe that the present phase leads to."""


class ExpertAgent:
    """Follows the task's keyframes one by one, and says what a network should have said.

    Args:
        task: Whose expert it is.
        config: Noise.
        planner: Of its motions; by default the task's for demonstrations.
    """

    def __init__(
        self,
        task: Tabletop,
        config: DemonstrationConfig = DemonstrationConfig(),
        planner: MotionPlanner | None = None,
    ) -> None:
        self._task, self._config = task, config
        self.planner = planner or task.expert_planner()
        self._scripts: list[_Script] = []
        once = Algorithm1Config(tries=1)
        self._algorithm = Algorithm1(task, self.planner, self.predict, config=once)

    def reset(self, seeds: Sequence[int]) -> None:
        """Begins a batch, one episode a seed; a seed says whether its episode is noisy."""
        self._algorithm.reset(seeds)
        self._scripts = []
        for seed in seeds:
            rng = np.random.default_rng([seed, 1])
            noisy = bool(rng.random() < self._config.noisy_episodes)
            self._scripts.append(_Script(rng, noisy))

    def act(self, number: int, lanes: list[int], observation: Observation) -> Action:
        """To the next keyframes, as Algorithm 1 gets to its subgoals."""
        return self._algorithm.act(number, lanes, observation)

    def obstacle(self, lane: int) -> str:
        """Why the last action moved nothing in a lane."""
        return self._algorithm.obstacle(lane)

    def predict(
        self, observation: Observation, lanes: list[int]
    ) -> tuple[Subgoal, None]:
        """Where to drive to: labels, with a noisy episode's noise. From privileged state."""
        q_toggle, q_goal = (np.zeros(observation.q.shape) for _ in range(2))
        gripper_toggle = np.zeros(len(q_goal), int)
        for e in lanes:
            self._advance(e, observation.q[e])
            q_toggle[e], gripper_toggle[e], q_goal[e] = self._perturbed(e)
        return Subgoal(q_toggle, gripper_toggle, q_goal), None

    def label(self, lane: int) -> Subgoal:
        """The clean label of the lane's present phase."""
        keyframes = self.keyframes(lane)
        q_goal = keyframes.q[self._scripts[lane].next]
        return Subgoal(keyframes.q[-1], keyframes.gripper_toggle, q_goal)

    def keyframes(self, lane: int) -> Keyframes:
        """The way that the lane is on."""
        keyframes = self._scripts[lane].keyframes
        assert keyframes is not None, "asked before the episode was observed"
        return keyframes

    def _advance(self, lane: int, q: np.ndarray) -> None:
        """To the next keyframe, or to the next toggle's once the gripper has toggled."""
        script, closed = self._scripts[lane], int(self._task.closed[lane])
        keyframes = script.keyframes
        if keyframes is None or keyframes.gripper_toggle == closed:
            script.keyframes, script.next = self._task.keyframes(lane, q), 0
        else:
            script.next = min(script.next + 1, len(keyframes.q) - 1)

    def _perturbed(self, lane: int) -> Subgoal:
        """The label, or in a noisy episode a place beside it."""
        script, label = self._scripts[lane], self.label(lane)
        if not script.noisy:
            return label
        at_toggle = script.next == len(self.keyframes(lane).q) - 1
        config = self._config
        scale = config.toggle_noise if at_toggle else config.keyframe_noise
        q_goal = label.q_goal + script.rng.normal(0, scale, len(label.q_goal))
        return label._replace(
            q_toggle=q_goal if at_toggle else label.q_toggle, q_goal=q_goal
        )

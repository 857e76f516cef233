"""Batch evaluation of the whole method over seeds."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from jaxplan import tasks
from jaxplan.algorithm1 import Algorithm1, Algorithm1Config, Predict
from jaxplan.base import Listener, Observation, Subgoal
from jaxplan.config import (
    EXECUTED_TRAJECTORY,
    PAPER_PLANNER,
    PlannerConfig,
    TrajectoryConfig,
)
from jaxplan.episodes import EpisodeConfig, EpisodeRecord, run_episodes
from jaxplan.evaluation.memo import Memo, code_digest
from jaxplan.evaluation.statistics import wilson
from jaxplan.evaluation.toggle_error import ToggleError, ToggleErrors, summarize
from jaxplan.learned import learned
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.ranges import Checked, Count, NotNegative
from jaxplan.simulation.physics import CONTROL_PERIOD
from jaxplan.tasks.perturbation import NOMINAL, Perturbation


@dataclasses.dataclass(frozen=True)
class ClosedLoopConfig(Checked):
    """What runs, and how."""

    planner: PlannerConfig = PAPER_PLANNER
    trajectory: TrajectoryConfig = EXECUTED_TRAJECTORY
    algorithm: Algorithm1Config = Algorithm1Config()
    episode: EpisodeConfig = EpisodeConfig()
    task: str = tasks.DEFAULT
    variant: str = "plain"
    """Of the task's scene."""
    camera: str = "hand"
    batch: Count = 32
    """Episodes in lockstep."""
    inference_steps: Count | None = None
    """Denoising steps; None: the sampler's own number, 25 for DDIM."""
    friction: NotNegative = 1.0
    """Factor on all friction; 0 shows that grasps hold by friction alone."""
    perturbation: Perturbation = NOMINAL
    """What varies in the pictures."""
    objects: str = tasks.ONE
    """Which objects the episodes have: one, train, held_out."""
    prediction_noise: NotNegative = 0.0
    """Standard deviation of noise on each joint of what the upper network says [rad]."""


class ClosedLoop:
    """Everything that runs the method's episodes, compiled once and used for any number of them.

    Args:
        weights: Predictor and sampler.
        config: Settings.
    """

    def __init__(
        self,
        weights: tuple[Weights, Weights],
        config: ClosedLoopConfig = ClosedLoopConfig(),
    ) -> None:
        if config.trajectory.control_period != CONTROL_PERIOD:
            raise ValueError(
                f"control_period {config.trajectory.control_period}: "
                f"the simulation plays at {CONTROL_PERIOD} s"
            )
        self.config, self._weights = config, weights
        self.task = tasks.load(
            config.task,
            config.batch,
            config.variant,
            config.camera,
            config.friction,
            config.perturbation,
            config.objects,
        )
        self.learned = learned(self.task, weights, config.inference_steps)
        self.planner = MotionPlanner(
            self.task.planning_scene,
            self.task.robot.limits,
            config.planner,
            config.trajectory,
        )
        # One phase of one episode compiles all, so that no planning time includes it.
        self._episodes([0], EpisodeConfig(max_phases=1))

    def perturb(
        self,
        perturbation: Perturbation,
        objects: str | None = None,
        regrasp: bool | None = None,
    ) -> None:
        """Lets other things vary from now on; nothing compiles anew.

        Args:
            perturbation: In the pictures.
            objects: The episodes'; as before where None.
            regrasp: Whether a hand that holds nothing looks again; as before where None.

        Raises:
            ValueError: One object for all where the loop began with drawn ones, or the
                other way round.
        """
        objects = objects or self.config.objects
        self.task.draw(objects)
        self.task.eyes.perturbation = perturbation
        algorithm = self.config.algorithm
        if regrasp is not None:
            algorithm = dataclasses.replace(algorithm, regrasp=regrasp)
        self.config = dataclasses.replace(
            self.config,
            perturbation=perturbation,
            objects=objects,
            algorithm=algorithm,
        )

    def run(
        self,
        seeds: Sequence[int],
        progress: Callable[[int], object] = lambda done: None,
        predict: Predict | None = None,
        listen: Listener | None = None,
        memo: Memo | None = None,
    ) -> dict[str, Any]:
        """Runs one episode per seed.

        Args:
            seeds: Episodes.
            progress: Called with the number of episodes of each finished batch.
            predict: Takes the place of the agent's `predict` (ablations).
            listen: Called once a round, beside the toggle errors.
            memo: Keeps finished batches, so that a killed run goes on after them. Not
                together with `predict` and `listen`, of which it knows nothing.

        Returns:
            JSON-ready: success_rate, wilson_95, episodes, toggle_error, config.
        """
        assert memo is None or (predict is None and listen is None)
        measured, watch = ToggleErrors(self.task), self.task.watch()
        listeners = [measured, watch, *([] if listen is None else [listen])]

        def piece(part: Sequence[int]) -> dict[str, Any]:
            start = time.perf_counter()
            records = self._episodes(part, self.config.episode, predict, listeners)
            seconds = time.perf_counter() - start
            kinds = watch.finish(records)
            episodes = [
                record.as_json() | {"kind": kind}
                for record, kind in zip(records, kinds, strict=True)
            ]
            return {
                "episodes": episodes,
                "errors": measured.finish(),
                "seconds": seconds,
            }

        pieces = []
        for first in range(0, len(seeds), self.config.batch):
            part = list(seeds[first : first + self.config.batch])
            if memo is None:
                pieces.append(piece(part))
            else:
                pieces.append(memo(self._settings(part), partial(piece, part)))
            progress(len(part))
        episodes = [episode for piece in pieces for episode in piece["episodes"]]
        errors = [ToggleError(*row) for piece in pieces for row in piece["errors"]]
        return self._result(episodes) | {
            "toggle_error": summarize(errors),
            "seconds": sum(piece["seconds"] for piece in pieces),
        }

    def _settings(self, seeds: Sequence[int]) -> dict[str, Any]:
        """All that decides how these episodes go."""
        return {
            "study": dataclasses.asdict(self.config),
            "weights": [network.info.get("sha256") for network in self._weights],
            "seeds": [int(seed) for seed in seeds],
            "code": code_digest(("",)),
        }

    def _episodes(
        self,
        seeds: Sequence[int],
        config: EpisodeConfig,
        predict: Predict | None = None,
        listeners: Sequence[Listener] = (),
    ) -> list[EpisodeRecord]:
        """One batch."""
        predict = self._noisy(predict or self.learned.predict, seeds)
        propose, settings = self.learned.propose, self.config.algorithm
        agent = Algorithm1(self.task, self.planner, predict, propose, settings)
        return run_episodes(self.task, agent, seeds, config, listeners)

    def _noisy(self, predict: Predict, seeds: Sequence[int]) -> Predict:
        """The upper network, less precise by `prediction_noise`."""
        scale = self.config.prediction_noise
        if scale == 0:
            return predict
        rng = np.random.default_rng(list(seeds))

        def noisy(
            observation: Observation, lanes: list[int]
        ) -> tuple[Subgoal, np.ndarray | None]:
            subgoal, features = predict(observation, lanes)
            shape = len(lanes), subgoal.q_toggle.shape[1]
            q_toggle, q_goal = subgoal.q_toggle.copy(), subgoal.q_goal.copy()
            q_toggle[lanes] += rng.normal(0, scale, shape)
            q_goal[lanes] += rng.normal(0, scale, shape)
            return subgoal._replace(q_toggle=q_toggle, q_goal=q_goal), features

        return noisy

    def _result(self, episodes: list[dict[str, Any]]) -> dict[str, Any]:
        successes = sum(episode["success"] for episode in episodes)
        phases = [phase for episode in episodes for phase in episode["phases"]]
        return {
            "success_rate": successes / len(episodes),
            "wilson_95": list(wilson(successes, len(episodes))),
            "successes": successes,
            "trials": len(episodes),
            "expansions_per_success": _mean(
                [e["expansions"] for e in episodes if e["success"]]
            ),
            "phases_solved": _mean([phase["status"] == "SOLVED" for phase in phases]),
            "episodes": episodes,
            "weights": {
                name: network.info.get("sha256")
                for name, network in zip(
                    ("predictor", "sampler"), self._weights, strict=True
                )
            },
            "config": dataclasses.asdict(self.config),
        }


def evaluate(
    seeds: Sequence[int],
    weights: tuple[Weights, Weights],
    config: ClosedLoopConfig = ClosedLoopConfig(),
    progress: Callable[[int], object] = lambda done: None,
    memo: Memo | None = None,
) -> dict[str, Any]:
    """Runs one episode per seed; see `ClosedLoop.run`."""
    batch = min(config.batch, len(seeds))
    loop = ClosedLoop(weights, dataclasses.replace(config, batch=batch))
    return loop.run(seeds, progress, memo=memo)


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None

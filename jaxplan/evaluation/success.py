"""Batch evaluation of the whole method over seeds."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from jaxplan.agent import Agent
from jaxplan.config import (
    MUG_TRAJECTORY,
    PAPER_PLANNER,
    PlannerConfig,
    RolloutConfig,
    TrajectoryConfig,
)
from jaxplan.evaluation.memo import Memo, code_digest
from jaxplan.evaluation.statistics import wilson
from jaxplan.evaluation.toggle_error import ToggleError, ToggleErrors, summarize
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.provenance import versions
from jaxplan.rollout import EpisodeRecord, Phase, Predict, Targets, rollout
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.simulation.physics import CONTROL_PERIOD
from jaxplan.tasks.mug.scene import Variant
from jaxplan.tasks.mug.task import MugTask


@dataclasses.dataclass(frozen=True)
class Success:
    """Settings of a success study."""

    planner: PlannerConfig = PAPER_PLANNER
    trajectory: TrajectoryConfig = MUG_TRAJECTORY
    rollout: RolloutConfig = RolloutConfig()
    camera: str = "hand"
    batch: int = 32
    """Episodes in lockstep."""
    inference_steps: int | None = None
    """Denoising steps; None: the sampler's own number, 25 for DDIM."""
    friction: float = 1.0
    """Factor on all friction; 0 shows that grasps hold by friction alone."""
    variant: Variant = "plain"
    prediction_noise: float = 0.0
    """Standard deviation of noise on each joint of what the upper network says [rad]."""


class Study:
    """Everything that runs episodes, compiled once and used for any number of them.

    Args:
        weights: Predictor and sampler.
        config: Settings.
    """

    def __init__(
        self, weights: tuple[Weights, Weights], config: Success = Success()
    ) -> None:
        if config.trajectory.control_period != CONTROL_PERIOD:
            raise ValueError(
                f"control_period {config.trajectory.control_period}: "
                f"the simulation plays at {CONTROL_PERIOD} s"
            )
        self.config, self._weights = config, weights
        self.task = MugTask(
            config.batch, config.camera, config.friction, variant=config.variant
        )
        for network in weights:
            network.check_fits(self.task.name, config.camera)
        self.planner = MotionPlanner(
            self.task.planning_scene, PANDA_LIMITS, config.planner, config.trajectory
        )
        self.agent = Agent(*weights, config.batch, config.inference_steps)
        # One phase of one episode compiles all, so that no planning time includes it.
        self._rollout([0], RolloutConfig(max_phases=1))

    def run(
        self,
        seeds: Sequence[int],
        progress: Callable[[int], object] = lambda done: None,
        predict: Predict | None = None,
        listen: Callable[[Phase], None] | None = None,
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
            JSON-ready: success_rate, wilson_95, episodes, toggle_error, config, versions.
        """
        assert memo is None or (predict is None and listen is None)
        measured = ToggleErrors(self.task)

        def heard(phase: Phase) -> None:
            measured(phase)
            if listen is not None:
                listen(phase)

        def piece(part: Sequence[int]) -> dict[str, Any]:
            start = time.perf_counter()
            records = self._rollout(part, self.config.rollout, predict, heard)
            seconds = time.perf_counter() - start
            episodes = [episode_json(record) for record in records]
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

    def _rollout(
        self,
        seeds: Sequence[int],
        config: RolloutConfig,
        predict: Predict | None = None,
        listen: Callable[[Phase], None] | None = None,
    ) -> list[EpisodeRecord]:
        """One batch."""
        return rollout(
            self.task,
            seeds,
            self._noisy(predict or self.agent.predict, seeds),
            self.planner,
            self.agent.propose,
            config,
            listen,
        )

    def _noisy(self, predict: Predict, seeds: Sequence[int]) -> Predict:
        """The upper network, less precise by `prediction_noise`."""
        scale = self.config.prediction_noise
        if scale == 0:
            return predict
        rng = np.random.default_rng(list(seeds))

        def noisy(observation: Any, episodes: list[int]) -> Targets:
            targets = predict(observation, episodes)
            shape = targets.q_toggle.shape
            return targets._replace(
                q_toggle=targets.q_toggle + rng.normal(0, scale, shape),
                q_goal=targets.q_goal + rng.normal(0, scale, shape),
            )

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
            "versions": versions(),
        }


def evaluate(
    seeds: Sequence[int],
    weights: tuple[Weights, Weights],
    config: Success = Success(),
    progress: Callable[[int], object] = lambda done: None,
    memo: Memo | None = None,
) -> dict[str, Any]:
    """Runs one episode per seed; see `Study.run`."""
    batch = min(config.batch, len(seeds))
    study = Study(weights, dataclasses.replace(config, batch=batch))
    return study.run(seeds, progress, memo=memo)


def episode_json(record: EpisodeRecord) -> dict[str, Any]:
    """An episode as JSON."""
    return {
        "seed": record.seed,
        "success": record.success,
        "failure": record.failure,
        "expansions": record.expansions,
        "planning_seconds": record.planning_seconds,
        "phases": [phase._asdict() for phase in record.phases],
    }


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None

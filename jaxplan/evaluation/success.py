"""Batch evaluation of the whole method over seeds."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

from jaxplan.agent import Agent
from jaxplan.config import PlannerConfig, RolloutConfig, TrajectoryConfig
from jaxplan.evaluation.provenance import versions
from jaxplan.evaluation.statistics import wilson
from jaxplan.evaluation.toggle_error import ToggleErrors
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.rollout import EpisodeRecord, Phase, Predict, rollout
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.tasks.mug.task import MugTask


@dataclasses.dataclass(frozen=True)
class Success:
    """Settings of a success study."""

    planner: PlannerConfig = PlannerConfig()
    trajectory: TrajectoryConfig = TrajectoryConfig()
    rollout: RolloutConfig = RolloutConfig()
    camera: str = "hand"
    batch: int = 32
    """Episodes in lockstep."""
    inference_steps: int = 25
    """DDIM steps."""
    friction: float = 1.0
    """Factor on all friction; 0 shows that grasps hold by friction alone."""


def evaluate(
    seeds: Sequence[int],
    weights: tuple[Weights, Weights],
    config: Success = Success(),
    progress: Callable[[int], object] = lambda done: None,
    change_predict: Callable[[Agent, MugTask], Predict] | None = None,
    listen: Callable[[MugTask, Phase], None] | None = None,
) -> dict[str, Any]:
    """Runs one episode per seed.

    Args:
        seeds: Episodes.
        weights: Predictor and sampler.
        config: Settings.
        progress: Called with the number of episodes of each finished batch.
        change_predict: Puts something else in the place of the agent's `predict` (ablations).
        listen: Called once a round, beside the toggle errors.

    Returns:
        A JSON-ready dict: success_rate, wilson_95, episodes, toggle_error, config, versions.
    """
    batch = min(config.batch, len(seeds))
    task = MugTask(batch, config.camera, config.friction)
    planner = MotionPlanner(
        task.planning_scene, PANDA_LIMITS, config.planner, config.trajectory
    )
    agent = Agent(*weights, batch, config.inference_steps)
    predict = agent.predict if change_predict is None else change_predict(agent, task)
    errors = ToggleErrors(task)

    def heard(phase: Phase) -> None:
        errors(phase)
        if listen is not None:
            listen(task, phase)

    start = time.perf_counter()
    records: list[EpisodeRecord] = []
    for first in range(0, len(seeds), batch):
        part = seeds[first : first + batch]
        records += rollout(
            task, part, predict, planner, agent.propose, config.rollout, heard
        )
        errors.finish()
        progress(len(part))
    successes = sum(record.success for record in records)
    phases = [phase for record in records for phase in record.phases]
    return {
        "success_rate": successes / len(records),
        "wilson_95": list(wilson(successes, len(records))),
        "successes": successes,
        "trials": len(records),
        "expansions_per_success": _mean([r.expansions for r in records if r.success]),
        "phases_solved": _mean([phase.status == "SOLVED" for phase in phases]),
        "toggle_error": errors.summary(),
        "seconds": time.perf_counter() - start,
        "episodes": [episode_json(record) for record in records],
        "weights": {
            name: network.info.get("sha256")
            for name, network in zip(("predictor", "sampler"), weights, strict=True)
        },
        "config": dataclasses.asdict(config),
        "versions": versions(),
    }


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

"""One episode for people: a line per phase, `episode.json`, a video and a film strip."""

import json
import os
import time
from pathlib import Path

import numpy as np

from jaxplan.agent import Agent
from jaxplan.evaluation import Success, versions
from jaxplan.evaluation.success import episode_json
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.planning import Status
from jaxplan.rollout import EpisodeRecord, Phase, rollout
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.tasks.mug.film import Film
from jaxplan.tasks.mug.task import MugTask


def solve(
    seed: int,
    weights: tuple[Weights, Weights],
    out: str | os.PathLike | None = None,
    config: Success = Success(),
) -> EpisodeRecord:
    """Plans and executes one mug episode with learned weights.

    Args:
        seed: Of the mug's pose.
        weights: Predictor and sampler.
        out: Directory for `episode.json`, `episode.mp4` and `phases.png`; None writes nothing.
        config: Settings, as of the success study.
    """
    task = MugTask(1, config.camera, config.friction)
    planner = MotionPlanner(
        task.planning_scene, PANDA_LIMITS, config.planner, config.trajectory
    )
    agent = Agent(*weights, 1, config.inference_steps)
    film, directory = None, None if out is None else Path(out)
    if directory is not None:
        directory.mkdir(parents=True, exist_ok=True)
        film = Film(task)
    clock = time.perf_counter()

    def listen(phase: Phase) -> None:
        nonlocal clock
        period = config.trajectory.control_period
        print(_line(phase, period, time.perf_counter() - clock))
        if film is not None:
            film.add_phase(phase)
        clock = time.perf_counter()

    record = rollout(
        task, [seed], agent.predict, planner, agent.propose, config.rollout, listen
    )[0]
    print(
        f"seed {seed}: {'success' if record.success else f'failed: {record.failure}'}, "
        f"{len(record.phases)} phases, {record.expansions} expansions, "
        f"{record.planning_seconds:.2f} s of search"
    )
    if film is not None and directory is not None:
        episode = {**episode_json(record), "versions": versions()}
        (directory / "episode.json").write_text(json.dumps(episode, indent=1) + "\n")
        film.write(directory)
        print(f"written: {directory / 'episode.json'}, episode.mp4, phases.png")
    return record


def _line(phase: Phase, period: float, seconds: float) -> str:
    """What happens in a phase of a batch of one, in a line."""
    targets, result, motion = phase.targets, phase.motion.result, phase.motion
    act = ("close" if targets.gripper_toggle[0] else "open") if phase.last[0] else "-"
    distance = np.linalg.norm(targets.q_goal[0] - phase.observation.q[0])
    return (
        f"phase {phase.number + 1:2d}: {distance:4.2f} rad to the subgoal, "
        f"{Status(result.status[0]).name.lower()} after {int(result.expansions[0])} "
        f"expansions in {motion.seconds:.2f} s, motion of {len(motion.q[0]) * period:.1f} s, "
        f"gripper {act} ({seconds:.1f} s in all)"
    )

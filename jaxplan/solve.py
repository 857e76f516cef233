"""One episode for people: a line per phase, `episode.json`, a video and a film strip."""

import dataclasses
import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from jaxplan.base import Phase
from jaxplan.evaluation import ClosedLoop, ClosedLoopConfig
from jaxplan.learning import Weights
from jaxplan.pictures.film import Film
from jaxplan.planning import Status
from jaxplan.provenance import versions
from jaxplan.simulation.camera import require_gl


def solve(
    seed: int,
    weights: tuple[Weights, Weights],
    out: str | os.PathLike | None = None,
    config: ClosedLoopConfig = ClosedLoopConfig(),
) -> dict[str, Any]:
    """Plans and executes one episode with learned weights.

    Args:
        seed: Of the episode.
        weights: Predictor and sampler.
        out: Directory for `episode.json`, `episode.mp4` and `phases.png`; None writes nothing.
        config: Of the closed loop.

    Returns:
        The episode as in `episode.json`.
    """
    require_gl()
    print("networks and planner are being compiled ...")
    loop = ClosedLoop(weights, dataclasses.replace(config, batch=1))
    film, directory = None, None if out is None else Path(out)
    if directory is not None:
        directory.mkdir(parents=True, exist_ok=True)
        film = Film(loop.task)
    clock = time.perf_counter()

    def listen(phase: Phase) -> None:
        nonlocal clock
        period = config.trajectory.control_period
        print(_line(phase, period, time.perf_counter() - clock))
        if film is not None:
            film.add_phase(phase)
        clock = time.perf_counter()

    result = loop.run([seed], listen=listen)
    episode = result["episodes"][0]
    verdict = "success" if episode["success"] else f"failed: {episode['failure']}"
    print(
        f"seed {seed}: {verdict}, {len(episode['phases'])} phases, "
        f"{episode['expansions']} expansions, {episode['planning_seconds']:.2f} s of search"
    )
    if film is not None and directory is not None:
        episode |= {"weights": result["weights"], "versions": versions()}
        (directory / "episode.json").write_text(json.dumps(episode, indent=1) + "\n")
        film.write(directory)
        print(f"written: {directory / 'episode.json'}, episode.mp4, phases.png")
    return episode


def _line(phase: Phase, period: float, seconds: float) -> str:
    """What happens in a phase of a batch of one, in a line."""
    decision = phase.action.decision
    subgoal, motion = decision.subgoal, decision.motion
    act = (
        ("close" if subgoal.gripper_toggle[0] else "open")
        if decision.at_toggle[0]
        else "-"
    )
    distance = np.linalg.norm(subgoal.q_goal[0] - phase.observation.q[0])
    return (
        f"phase {phase.number + 1:2d}: {distance:4.2f} rad to the subgoal, "
        f"{Status(motion.result.status[0]).name.lower()} after {int(motion.result.expansions[0])} "
        f"expansions in {motion.seconds:.2f} s, motion of {len(motion.q[0]) * period:.1f} s, "
        f"gripper {act} ({seconds:.1f} s in all)"
    )

"""Continuous certificates: how many paths they prove, how often falsely, how long they take.

    python eval/certificates.py --paths 500 --out runs/certificates.json

Paths of MotionBenchMaker's problems, planned with a margin, seed after seed. Each is
certified at default settings, by samples and by proof, side by side in time; then sampled
so finely that no two geoms move by more than 0.1 mm from one sample to the next. A proof is
false if that finds a contact deeper than the tolerance, or one nearer than what was proven.
"""

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from itertools import count, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np
from peers import slots_for
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.collision import World, certify, make_world
from jaxplan.config import PlannerConfig
from jaxplan.evaluation import wilson
from jaxplan.evaluation.motion_bench import (
    data_directory,
    read_problems,
    read_robot,
    robot_mjcf,
)
from jaxplan.evaluation.result import write_result
from jaxplan.motion import Planner
from jaxplan.ranges import Checked, Count, NotNegative, Positive, Whole
from jaxplan.scene import Scene

ROUNDING = 1e-6
"""Of distances in single precision [m]."""


@dataclass(frozen=True)
class Args(Checked):
    """Proves paths and looks for what the proofs overlooked."""

    out: Path = Path("runs/certificates.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the Panda's spheres and the problems."""
    paths: Count = 500
    first: Whole = 0
    """How many paths to pass over, so that a long run can be made in parts."""
    margin: NotNegative = 0.002
    """Of the planner [m]."""
    tolerance: NotNegative = 0.001
    """Of the certificates [m]."""
    fine: Positive = 1e-4
    """Motion between samples that look for what a proof overlooked [m]."""


class Planned(NamedTuple):
    """A planned path, and where."""

    name: str
    scene: Scene
    world: World
    waypoints: np.ndarray


@dataclass(frozen=True)
class Outcome:
    """What was said about one path."""

    name: str
    waypoints: int
    sampled: bool
    proven: bool
    reason: str
    clearance: float
    """Proven [m]."""
    finest: float
    """Least clearance of the fine samples [m]."""
    false: bool
    seconds: tuple[float, float]
    """Sampled, proven."""


def main(args: Args) -> None:
    """Measures, prints, writes JSON."""
    outcomes = []
    with tqdm(total=args.paths, unit="path") as bar:
        for path in islice(planned(args), args.first, args.first + args.paths):
            outcomes.append(judged(path, args.tolerance, args.fine))
            bar.update()
    proven = sum(outcome.proven for outcome in outcomes)
    ratios = np.array([o.seconds[1] / o.seconds[0] for o in outcomes])
    result = {
        "paths": len(outcomes),
        "proven": proven,
        "wilson_95": wilson(proven, len(outcomes)),
        "false": sum(outcome.false for outcome in outcomes),
        "ratio": {
            "median": float(np.median(ratios)),
            "p95": float(np.percentile(ratios, 95)),
            "most": float(ratios.max()),
        },
        "milliseconds": [
            1000 * float(np.median([o.seconds[k] for o in outcomes])) for k in (0, 1)
        ],
        "outcomes": [asdict(outcome) for outcome in outcomes],
        "settings": {k: v for k, v in asdict(args).items() if isinstance(v, float)},
    }
    write_result(args.out, result)
    for key in ("paths", "proven", "false", "ratio", "milliseconds"):
        print(f"{key}: {result[key]}")
    for outcome in outcomes:
        if outcome.false or not outcome.proven:
            print(f"{outcome.name}: {outcome.reason or 'a false proof'}")
    print(f"written to {args.out}")


def planned(args: Args) -> Iterator[Planned]:
    """Paths without end, a seed's after another's, the sets in turns."""
    robot, sets = read_robot(args.data), read_problems(args.data)
    planners = {}
    for name, problems in sets.items():
        scene = Scene.from_mjcf(robot_mjcf(robot), slots=slots_for(problems))
        planners[name] = Planner(scene, PlannerConfig(margin=args.margin))
    longest = max(map(len, sets.values()))
    for number in count():
        seed, index = divmod(number, longest)
        for name, problems in sets.items():
            if index >= len(problems):
                continue
            planner, problem = planners[name], problems[index]
            world = make_world(planner.scene, obstacles=problem.obstacles)
            plan = planner.plan(problem.q_start, problem.q_goal, seed, world)
            if plan.solved:
                where = f"{name} {problem.index}, seed {seed}"
                yield Planned(where, planner.scene, world, plan.path)


def judged(path: Planned, tolerance: float, fine: float) -> Outcome:
    """Both certificates, in turns, the better of two times; and the fine samples."""
    _, scene, world, waypoints = path
    seconds = [np.inf, np.inf]
    verdicts = []
    for continuous in (False, True) * 2:  # the first time, they compile
        began = time.perf_counter()
        verdicts.append(
            certify(scene, world, waypoints, tolerance=tolerance, continuous=continuous)
        )
        took = time.perf_counter() - began
        seconds[continuous] = min(seconds[continuous], took)
    sampled, proof = verdicts[-2:]
    finest = certify(scene, world, waypoints, fine, tolerance)
    lower = proof.clearance if proof.proven else -np.inf
    return Outcome(
        path.name,
        len(waypoints),
        sampled.valid,
        bool(proof.proven),
        proof.reason,
        proof.clearance,
        finest.clearance,
        bool(proof.valid and not finest.valid) or lower > finest.clearance + ROUNDING,
        (seconds[0], seconds[1]),
    )


if __name__ == "__main__":
    run_script(main, Args)

"""Whether a time limit is kept: hard problems, each with the same limit, programs warm.

    python eval/time_limits.py --out runs/time_limits.json

A wall stands between start and goal of the table, on both sides of the base and above it: all of
the arm would have to be in the gap at once. Seed after seed.
"""

import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jaxplan import Obstacle, Planner, PlannerConfig, Scene
from jaxplan.cli import run_script
from jaxplan.evaluation.motion_bench import (
    data_directory,
    obstacles_mjcf,
    read_robot,
    robot_mjcf,
    table,
)
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Count, Positive

WALL = (
    Obstacle("box", [1.0, 0.005, 1.5], [1.15, 0.0, 0.5, 1, 0, 0, 0]),
    Obstacle("box", [1.0, 0.005, 1.5], [-1.15, 0.0, 0.5, 1, 0, 0, 0]),
    Obstacle("box", [0.15, 0.005, 0.7], [0.0, 0.0, 1.3, 1, 0, 0, 0]),
)
ASIDE = 0.6
"""Start and goal are turned away from the wall by this [rad]."""


@dataclass(frozen=True)
class Args(Checked):
    """Asks with a time limit and measures how long each answer took."""

    out: Path = Path("runs/time_limits.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the Panda's spheres."""
    problems: Count = 200
    time_limit: Positive = 0.1
    """[s]."""


def main(args: Args) -> None:
    """Measures, prints, writes JSON."""
    problem = table()
    obstacles = (*problem.obstacles[:1], *WALL)
    model = robot_mjcf(read_robot(args.data), obstacles_mjcf(obstacles))
    scene = Scene.from_mjcf(model)
    planner = Planner(scene, PlannerConfig(max_expansions=1_000_000))
    q_start, q_goal = problem.q_start.copy(), problem.q_goal.copy()
    q_start[0] += ASIDE
    q_goal[0] -= ASIDE
    planner.plan(q_start, q_goal, time_limit=5.0)  # compiles
    seconds, statuses = [], Counter()
    for seed in tqdm(range(args.problems), unit="problem"):
        began = time.perf_counter()
        plan = planner.plan(q_start, q_goal, seed=seed, time_limit=args.time_limit)
        seconds.append(time.perf_counter() - began)
        statuses[plan.status.name] += 1
    quantiles = np.quantile(seconds, [0.5, 0.95, 1.0]).tolist()
    result = {
        "time_limit": args.time_limit,
        "seconds": dict(zip(("median", "p95", "most"), quantiles, strict=True)),
        "statuses": dict(statuses),
    }
    write_result(args.out, result)
    print(f"{result['seconds']} s at a limit of {args.time_limit} s; {dict(statuses)}")
    print(f"written to {args.out}")


if __name__ == "__main__":
    run_script(main, Args)

"""MotionBenchMaker's problems: solved, how fast, how long, and certified by C MuJoCo.

    python eval/motion_bench.py --out runs/motion_bench.json
    python eval/motion_bench.py --robot fetch --out runs/motion_bench_fetch.json

One planner a set; the obstacles of its problems take turns in slots, so that nothing
compiles between problems. OMPL with C MuJoCo gets the same problems beside it. Paths are
certified every 5 mm, with 1 mm, in scenes that have no slots.
"""

import os
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from parts.queries import OURS, Answered, ask, length, planner_for, refused, rows_of
from parts.rows import Part, Row, compare, show
from peers import peer_versions

from jaxplan.cli import run_script
from jaxplan.evaluation.motion_bench import data_directory, read_problems, read_robot
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Positive

PART = "MotionBenchMaker"


@dataclass(frozen=True)
class Args(Checked):
    """Solves each problem of each set once, with warm programs."""

    out: Path = Path("runs/motion_bench.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the robots' spheres and the problems."""
    robot: Literal["panda", "fetch"] = "panda"
    quick: bool = False
    """5 problems a set."""
    sets: tuple[str, ...] = ()
    """All by default."""
    give_up: Positive = 10.0
    """When OMPL does [s]; a problem that it has not solved by then counts as that long."""


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    robot = read_robot(args.data, args.robot)
    every = read_problems(args.data, args.robot)
    if unknown := set(args.sets) - set(every):
        raise ValueError(f"no set {min(unknown)!r}: there are {', '.join(every)}")
    load = os.getloadavg()
    part = Part([], {}, {})
    bad: list[str] = []
    for name in args.sets or every:
        problems = every[name][: 5 if args.quick else None]
        found = ask(robot, name, problems, range(len(problems)), args.give_up)
        smooth = smoothed(robot, found[OURS])
        for row in rows_of(PART, name, found):
            more = dict(row.more)
            if row.side in found:
                lines = refused(robot, found[row.side])
                more["refused"] = len(lines)
                bad += [f"{row.side}: {line}" for line in lines]
            if row.side == OURS:
                more["smoothed"] = smooth
                part.counts[f"{name}: paths of {OURS} that C MuJoCo refuses"] = more[
                    "refused"
                ]
            part.rows.append(replace(row, more=more))
        save(args, part, bad, load)
    show(part)
    for line in bad:
        print(f"refused: {line}")
    print(f"written to {args.out}")


def save(
    args: Args, part: Part, bad: list[str], load: tuple[float, float, float]
) -> None:
    """Writes what there is so far."""
    part.ratios.update(compare(part.rows, OURS, 0.6) | compare(_p95(part), OURS, 0.6))
    result = {
        "rows": [asdict(row) for row in part.rows],
        "ratios": {name: ratio.value for name, ratio in part.ratios.items()},
        "counts": part.counts,
        "refused": bad,
        "quick": args.quick,
        "give_up": args.give_up,
        "load": [load, os.getloadavg()],
    }
    write_result(args.out, result, peer_versions())


def smoothed(robot: dict, queries: list[Answered]) -> float | None:
    """Median length of the motions after shortcuts and smoothing [rad]."""
    planner, worlds = planner_for(robot, [query.problem for query in queries])
    lengths = []
    for (problem, seed, answer), world in zip(queries, worlds, strict=True):
        if answer.solved:
            plan = planner.plan(problem.q_start, problem.q_goal, seed, world)
            lengths.append(length(planner.time(plan).q))
    return float(np.median(lengths)) if lengths else None


def _p95(part: Part) -> list[Row]:
    return [
        replace(row, scene=f"{row.scene}, p95", median=row.more["p95"])
        for row in part.rows
        if row.median is not None
    ]


if __name__ == "__main__":
    run_script(main, Args)

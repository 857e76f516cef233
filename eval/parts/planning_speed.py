"""Planning: one query at a time, and 256 problems in a call, against OMPL with C MuJoCo."""

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path

import jax
import numpy as np
from peers import absent
from tqdm import tqdm

from jaxplan.evaluation.motion_bench import (
    BenchProblem,
    read_problems,
    read_robot,
    sphere_cage,
    table,
)
from parts.queries import OMPL, OURS, ask, planner_for, refused, rows_of
from parts.rows import Part, Row, compare, row_of

PART = "planning"
LEAST = 0.6
"""Times of searches scatter more than those of queries."""
BATCH = 256


def measure(quick: bool, data: Path) -> Part:
    """All scenes; a row that says so where the data are absent."""
    try:
        robot, sets = read_robot(data), read_problems(data)
    except FileNotFoundError as error:
        note = Row(PART, "Panda as spheres", "all sides", note=str(error))
        return Part([note], {}, {})
    seeds = 10 if quick else 40
    scenes = {p.set: [p] * seeds for p in (sphere_cage(), table())}
    scenes |= {"box": sets["box"][:10]} if quick else sets
    rows: list[Row] = []
    counts: dict[str, int] = {}
    for name, problems in scenes.items():
        found = ask(robot, f"{PART}, {name}", problems, range(len(problems)))
        rows += rows_of(PART, name, found)
        bad = refused(robot, found[OURS])
        unsolved = sum(not query.answer.solved for query in found[OURS])
        counts[f"{PART}, {name}: not solved by {OURS}"] = unsolved
        counts[f"{PART}, {name}: paths that C MuJoCo refuses"] = len(bad)
    slow = [
        replace(row, scene=f"{row.scene}, p95", median=row.more["p95"])
        for row in rows
        if row.median is not None
    ]
    ratios = compare(rows, OURS, LEAST) | compare(slow, OURS, LEAST)
    every = [
        problem for problems in zip(*sets.values(), strict=True) for problem in problems
    ]
    batches = {f"sphere_cage, {BATCH} seeds": [sphere_cage()] * BATCH}
    if not quick:
        name = f"MotionBenchMaker, {BATCH} problems"
        batches[name] = list(islice(cycle(every), BATCH))
    for name, problems in batches.items():
        measured, unsolved = batch_rows(robot, name, problems, 3 if quick else 10)
        rows += measured
        ratios |= compare(measured, f"{OURS}, one call", LEAST)
        counts[f"{PART}, {name}: not solved by {OURS}"] = unsolved
    return Part(rows, ratios, counts)


def batch_rows(
    robot: dict, name: str, problems: Sequence[BenchProblem], rounds: int
) -> tuple[list[Row], int]:
    """Problems a second of each side, and how many ours did not solve.

    OMPL takes long, so that it has one round, in the midst of ours.
    """
    planner, worlds = planner_for(robot, problems)
    stacked = jax.tree.map(lambda *leaves: np.stack(leaves), *worlds)
    world = worlds[0] if worlds[0] is worlds[-1] else stacked
    starts, goals = (
        np.array([getattr(problem, end) for problem in problems])
        for end in ("q_start", "q_goal")
    )
    planner.plan_batch(starts, goals, None, world)  # compiles

    def ours() -> float:
        start = time.perf_counter()
        plans.append(planner.plan_batch(starts, goals, None, world))
        return len(problems) / (time.perf_counter() - start)

    plans: list[list] = []
    sides = ompl_sides()
    rates = [ours() for _ in range(rounds - rounds // 2)]
    rows = []
    for side, processes in tqdm(sides.items(), desc=f"{PART}, {name}"):
        rows.append(ompl_row(robot, name, side, problems, processes))
    rates += [ours() for _ in range(rounds // 2)]
    solved = sum(plan.solved for plan in plans[-1])
    more = {"solved": solved, "of": len(problems)}
    own = row_of(
        PART, name, f"{OURS}, one call", "problems/s", rates, len(problems), **more
    )
    return [own, *rows], len(problems) - solved


def ompl_sides() -> dict[str, int]:
    """OMPL's sides, and the processes of each."""
    cores = os.cpu_count() or 1
    return {f"{OMPL}, one process": 1, f"{OMPL}, a process a core": cores}


def ompl_row(
    robot: dict, name: str, side: str, problems: Sequence[BenchProblem], processes: int
) -> Row:
    if reason := absent("ompl"):
        return Row(PART, name, side, note=reason)
    from peers.ompl_peer import solve_in_processes

    seeds = range(len(problems))
    answers, seconds = solve_in_processes(robot, problems, seeds, processes, 1.0)
    more = {"solved": sum(answer.solved for answer in answers), "of": len(answers)}
    rate = [len(problems) / seconds]
    return row_of(PART, name, side, "problems/s", rate, len(problems), **more)

"""Single planning queries, side by side: jaxplan, and OMPL with C MuJoCo.

Everyone gets the same geoms, pairs, starts and goals, no margin, and the same resolution
of motions. Sides take turns problem by problem. Ours is timed from the arrays that go in to
the path that comes out, OMPL in its `solve` alone.
"""

import time
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from peers import Planned, absent, peer_model, slots_for
from tqdm import tqdm

from jaxplan.collision import World, certify, make_world
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.motion_bench import BenchProblem, obstacles_mjcf, robot_mjcf
from jaxplan.motion import Planner
from jaxplan.scene import Scene
from parts.rows import Row, row_of

OURS = "jaxplan"
OMPL = "OMPL + MuJoCo C"
RANGES = {OMPL: None, f"{OMPL}, range 1": 1.0}
"""Longest edge [rad] of each of OMPL's sides; None = its default."""


class Answered(NamedTuple):
    """A problem and its answer."""

    problem: BenchProblem
    seed: int
    answer: Planned


def planner_for(
    robot: dict, problems: Sequence[BenchProblem]
) -> tuple[Planner, list[World]]:
    """Our planner, compiled once for all of the problems, and the world of each.

    Obstacles are in slots; those of a single problem are part of the scene.
    """
    if len({id(problem) for problem in problems}) == 1:
        scene = _scene(robot, problems[0])
        worlds = [make_world(scene)] * len(problems)
    else:
        scene = Scene.from_mjcf(robot_mjcf(robot), slots=slots_for(problems))
        worlds = [make_world(scene, obstacles=p.obstacles) for p in problems]
    return Planner(scene, PlannerConfig(margin=0.0)), worlds


def ask(
    robot: dict,
    name: str,
    problems: Sequence[BenchProblem],
    seeds: Sequence[int],
    give_up: float = 10.0,
) -> dict[str, list[Answered]]:
    """Answers of each side that is here to all problems; OMPL gives up after so many seconds."""
    planner, worlds = planner_for(robot, problems)

    def ours(i: int) -> Planned:
        problem = problems[i]
        start = time.perf_counter()
        plan = planner.plan(problem.q_start, problem.q_goal, seeds[i], worlds[i])
        seconds = time.perf_counter() - start
        return Planned(plan.solved, plan.reason, plan.path, plan.checks, seconds)

    ours(0)  # compiles
    sides: dict[str, Callable[[int], Planned]] = {OURS: ours}
    if not absent("ompl"):
        sides |= _ompl_sides(robot, problems, seeds, give_up)
    found: dict[str, list[Answered]] = {side: [] for side in sides}
    for i in tqdm(range(len(problems)), desc=name, unit="problem"):
        for side, solve in sides.items():
            found[side].append(Answered(problems[i], seeds[i], solve(i)))
    return found


def rows_of(part: str, scene: str, found: dict[str, list[Answered]]) -> list[Row]:
    """A row for each side, those that are not here included."""
    return [
        _row(part, scene, side, queries) for side, queries in found.items()
    ] + absent_rows(part, scene)


def absent_rows(part: str, scene: str) -> list[Row]:
    """Rows that say why OMPL has no figures; none if it is installed."""
    reason = absent("ompl")
    return [Row(part, scene, side, note=reason) for side in RANGES] if reason else []


def refused(robot: dict, queries: Sequence[Answered]) -> list[str]:
    """What `certify` says against paths: every 5 mm, no contact deeper than 1 mm.

    It checks scenes made from the obstacles themselves, without slots.
    """
    scene_of = cache(lambda index: _scene(robot, queries[index].problem))
    first: dict[int, int] = {}
    found = []
    for i, (problem, seed, answer) in enumerate(queries):
        if not answer.solved:
            continue
        scene = scene_of(first.setdefault(id(problem), i))
        verdict = certify(scene, make_world(scene), answer.path)
        if not verdict.valid:
            found.append(
                f"{problem.set} {problem.index}, seed {seed}: {verdict.reason}"
            )
    return found


def length(path: np.ndarray) -> float:
    """Of a path in joint space [rad]."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def _scene(robot: dict, problem: BenchProblem) -> Scene:
    return Scene.from_mjcf(robot_mjcf(robot, obstacles_mjcf(problem.obstacles)))


def _ompl_sides(
    robot: dict, problems: Sequence[BenchProblem], seeds: Sequence[int], give_up: float
) -> dict[str, Callable[[int], Planned]]:
    from peers.ompl_peer import OmplPlanner

    planners: dict[tuple[int, float | None], OmplPlanner] = {}

    def side(range: float | None) -> Callable[[int], Planned]:
        def solve(i: int) -> Planned:
            problem = problems[i]
            return planners[id(problem), range].solve(
                problem.q_start, problem.q_goal, seeds[i], give_up
            )

        return solve

    for problem in {id(problem): problem for problem in problems}.values():
        for range in RANGES.values():
            model = peer_model(robot, problem.obstacles)
            planners[id(problem), range] = OmplPlanner(model, range)
    return {name: side(range) for name, range in RANGES.items()}


def _row(part: str, scene: str, side: str, queries: list[Answered]) -> Row:
    milliseconds = [1000 * query.answer.seconds for query in queries]
    solved = [query.answer for query in queries if query.answer.solved]
    return row_of(
        part,
        scene,
        side,
        "ms",
        milliseconds,
        p95=float(np.percentile(milliseconds, 95)),
        solved=len(solved),
        of=len(queries),
        length=float(np.median([length(a.path) for a in solved])) if solved else None,
        checks=float(np.median([query.answer.checks for query in queries])),
    )

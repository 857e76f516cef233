"""OMPL's RRT-Connect with C MuJoCo as its checker: what users of both put together.

Needs the package `ompl`; `peers.absent("ompl")` says whether it is here.
"""

import multiprocessing
import time
from collections.abc import Sequence
from multiprocessing.synchronize import Barrier
from typing import Any

import mujoco
import numpy as np
from ompl import base, geometric, util  # pyright: ignore[reportMissingImports]

from jaxplan.evaluation.motion_bench import BenchProblem
from peers import Planned, peer_model

RESOLUTION = 1 / 32
"""Longest gap between checked configurations [rad], as VAMP's planner has it."""


class OmplPlanner:
    """RRT-Connect on one scene, which is set up once.

    Args:
        model: The scene.
        range: Longest edge [rad]; None: OMPL's default, a fifth of the space's extent.
            On MotionBenchMaker 1, as VAMP has it, is two to four times faster.
    """

    def __init__(self, model: mujoco.MjModel, range: float | None = None) -> None:
        data = mujoco.MjData(model)
        qpos, joints = data.qpos, model.nq
        self._range, self._checks = range, 0

        def valid(state: Any) -> bool:
            self._checks += 1
            qpos[:] = state[0:joints]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_collision(model, data)
            return data.ncon == 0

        space = base.RealVectorStateSpace(joints)
        bounds = base.RealVectorBounds(joints)
        for joint, (low, high) in enumerate(model.jnt_range):
            bounds.setLow(joint, low)
            bounds.setHigh(joint, high)
        space.setBounds(bounds)
        extent = space.getMaximumExtent()
        space.setLongestValidSegmentFraction(RESOLUTION / extent)
        self._setup = geometric.SimpleSetup(space)
        self._setup.setStateValidityChecker(valid)
        # Draws random numbers the first time, which shall not count among the seed's.
        self._setup.getSpaceInformation().setup()
        self._ends: tuple[Any, Any] = space.allocState(), space.allocState()

    def solve(
        self, q_start: np.ndarray, q_goal: np.ndarray, seed: int, limit: float = 10.0
    ) -> Planned:
        """Plans; only the solving itself is timed.

        Args:
            q_start: `[7]` [rad].
            q_goal: `[7]` [rad].
            seed: At least 0.
            limit: Wall time after which OMPL gives up [s].
        """
        # Mute, or it warns that a seed comes late; planners made from now on obey it.
        util.setLogLevel(util.LOG_NONE)
        util.RNG.setSeed(seed + 1)
        for state, q in zip(self._ends, (q_start, q_goal), strict=True):
            state[0 : len(q)] = q.tolist()
        setup = self._setup
        setup.clear()
        setup.setStartAndGoalStates(*self._ends)
        planner = geometric.RRTConnect(setup.getSpaceInformation())
        if self._range:
            planner.setRange(self._range)
        setup.setPlanner(planner)
        setup.setup()
        self._checks = 0
        start = time.perf_counter()
        status = setup.solve(limit)
        seconds = time.perf_counter() - start
        solved = setup.haveExactSolutionPath()
        states: list[Any] = setup.getSolutionPath().getStates() if solved else []
        rows = [state[0 : len(q_goal)] for state in states]
        path = np.array(rows).reshape(-1, len(q_goal))
        return Planned(solved, str(status), path, self._checks, seconds)


def solve_in_processes(
    robot: dict,
    problems: Sequence[BenchProblem],
    seeds: Sequence[int],
    processes: int,
    range: float | None = None,
) -> tuple[list[Planned], float]:
    """Solves problem i with seed i, one problem at a time in each process.

    Returns:
        The answers, and the wall time of all of them together [s]. Processes are running
        and their scenes are built before the clock starts.
    """
    # Spawned: a fork of a process that runs JAX's threads may hang.
    context = multiprocessing.get_context("spawn")
    ready = context.Barrier(processes + 1)
    with context.Pool(processes, _prepare, (robot, problems, range, ready)) as pool:
        ready.wait()
        start = time.perf_counter()
        answers = pool.starmap(_solve, enumerate(seeds), chunksize=1)
        return answers, time.perf_counter() - start


_prepared: list[tuple[OmplPlanner, BenchProblem]] = []
"""A process's scenes."""


def _prepare(
    robot: dict, problems: Sequence[BenchProblem], range: float | None, ready: Barrier
) -> None:
    for problem in problems:
        model = peer_model(robot, problem.obstacles)
        _prepared.append((OmplPlanner(model, range), problem))
    ready.wait()


def _solve(index: int, seed: int) -> Planned:
    planner, problem = _prepared[index]
    return planner.solve(problem.q_start, problem.q_goal, seed)

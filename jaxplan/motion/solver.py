"""Checked problems in, plans with reasons out: goals are read, searched for, and told of."""

import dataclasses
import math
import time
from collections.abc import Sequence
from functools import partial

import jax
import numpy as np
from numpy.typing import ArrayLike

from jaxplan.collision import World
from jaxplan.config import PlannerConfig
from jaxplan.ik import Limits, Pose
from jaxplan.motion.batch import Batch, BatchSearch
from jaxplan.motion.goals import Goals, goals_of, stacked
from jaxplan.motion.plan import Plan
from jaxplan.motion.reasons import Asked, no_path
from jaxplan.motion.sampling import Sampler
from jaxplan.motion.search import Search
from jaxplan.planning import PlanResult, Status
from jaxplan.planning.methods import method_of
from jaxplan.planning.space import TURN
from jaxplan.scene import Scene

Goal = ArrayLike | Pose
"""A configuration `[d]`, several `[G, d]` of which any will do, or where a body is to be."""
LEAST_TIME = 1e-3
"""That a search gets, however late it is [s]."""


class Solver:
    """Solves problems of one arm.

    Args:
        scene: What can touch what.
        config: Settings of the search.
        limits: Of the joints.
        search: Of the scene, with these.
        sampler: Proposes segments; without it all proposals are uniform.
    """

    def __init__(
        self,
        scene: Scene,
        config: PlannerConfig,
        limits: Limits,
        search: Search,
        sampler: Sampler | None,
    ) -> None:
        self._scene, self._config, self._limits = scene, config, limits
        self._search = search
        proposals = None if sampler is None else sampler.for_scene(scene)
        self._answers = BatchSearch(search, proposals)

    def __call__(
        self,
        q_start: np.ndarray,
        goals: Sequence[Goal],
        seeds: Sequence[int],
        world: World,
        own: bool,
        time_limit: float,
    ) -> list[Plan]:
        """Plans for rows `[P, d]`.

        Args:
            q_start: `[P, d]` [rad or m].
            goals: P.
            seeds: P.
            world: Of all, or with a leading axis P.
            own: Whether it has that axis.
            time_limit: Of all of them together [s].
        """
        count, began = len(seeds), time.perf_counter()
        worlds = [
            jax.tree.map(lambda leaf, r=row: leaf[r], world) if own else world
            for row in range(count)
        ]
        # A joint that comes round is searched near 0, and the path put back where it was.
        whole = np.where(np.isfinite(q_start), np.round(q_start / TURN), 0)
        turns = np.where(self._limits.circular, TURN * whole, 0)
        start = (q_start - turns).astype(np.float32)
        read = [
            goals_of(
                goal,
                start[row],
                self._scene,
                worlds[row],
                self._limits,
                seeds[row],
                partial(self._search.free, worlds[row]),
            )
            for row, goal in enumerate(goals)
        ]
        if not method_of(self._config).goal_sets:
            read = [goal._replace(q=goal.q[:1]) for goal in read]
        left = max(time_limit - (time.perf_counter() - began), LEAST_TIME)
        answer = self._answers(Batch(start, stacked(read), seeds, world, own), left)
        seconds = time.perf_counter() - began
        return [
            self._plan(
                jax.tree.map(lambda leaf, r=row: leaf[r], answer),
                (start[row], read[row]),
                turns[row],
                seconds,
                seeds[row],
                worlds[row],
                math.isinf(time_limit),
            )
            for row in range(count)
        ]

    def _plan(
        self,
        answer: PlanResult,
        asked: tuple[np.ndarray, Goals],
        turns: np.ndarray,
        seconds: float,
        seed: int,
        world: World,
        unhurried: bool,
    ) -> Plan:
        """One problem's answer, with its reason."""
        q_start, goals = asked
        status, path = Status(int(answer.status)), answer.path[: answer.path_length]
        if goals.status is not None and status != Status.START_IN_COLLISION:
            status, path = goals.status, path[:0]
        plan = Plan(
            status=status,
            path=np.asarray(path) + turns.astype(np.float32),
            expansions=int(answer.expansions),
            checks=int(answer.checks),
            time=seconds,
            reason="",
            seed=seed,
            world=world,
        )
        near = dataclasses.replace(plan, path=np.asarray(path))
        problem = Asked(
            self._scene,
            near,
            q_start,
            goals,
            self._limits,
            self._config.margin,
            np.asarray(answer.nodes),
            partial(self._search.free, world) if unhurried else None,
        )
        return dataclasses.replace(plan, reason=no_path(problem))

"""One episode's planning, timed phase by phase: the upper network, banks, search.

Samplers take turns at each phase, so that a busy machine slows all of them alike.
"""

import dataclasses
import time
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.config import PAPER_PLANNER, PlannerConfig
from jaxplan.evaluation.recorded_study import RecordedStudy
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.networks import Cond, predict
from jaxplan.planning import DrawBank, Segment, Status
from jaxplan.samplers import Bank

PROPOSALS = 100
"""Calls for the price of one proposal."""


UNIFORM = "uniform, 5 % goal bias"
"""The side without a sampler."""


class Side(NamedTuple):
    """A sampler at a share of uniform proposals."""

    name: str
    p_uniform: float


class Sampler:
    """A learned sampler for one problem at a time; counts the time it takes."""

    def __init__(self, weights: Weights, changes: dict[str, Any], bank: int) -> None:
        self._bank = Bank(weights, bank, **changes)
        self._one = Bank(weights, 1, **changes)
        self.seconds = 0.0

    def of(self, cond: Cond, key: jax.Array) -> DrawBank:
        """The planner's `draw` for one problem."""

        def draw(bank_number: jax.Array) -> Segment:
            start = time.perf_counter()
            drawn = jax.block_until_ready(self._bank.of(cond, key)(bank_number))
            self.seconds += time.perf_counter() - start
            return drawn

        return draw

    def proposal(self, cond: Cond, key: jax.Array) -> float:
        """Seconds of one proposal drawn alone, median."""
        times = []
        for number in range(PROPOSALS + 1):
            bank_number = jnp.full(1, number, jnp.int32)
            start = time.perf_counter()
            jax.block_until_ready(self._one.of(cond, key)(bank_number))
            times.append(time.perf_counter() - start)
        return float(np.median(times[1:]))


class Bench:
    """Everything that is timed, compiled once.

    Args:
        study: Problems and weights.
        sides: Names of samplers, with their weights and changes to their config.
        p_uniform: Shares of uniform proposals at which each sampler is timed.
        method: Of the search.
        bank: Segments that a sampler draws at a time.
    """

    def __init__(
        self,
        study: RecordedStudy,
        sides: dict[str, tuple[str, dict[str, Any]]],
        p_uniform: tuple[float, ...],
        method: Any,
        bank: int,
    ) -> None:
        self.problems, self.keys = study.problems, study.problems.keys()
        self.cond = study.cond
        upper = study.predictor
        self._upper = jax.jit(
            lambda image, q, gripper: predict(
                upper.config, upper.params, image, q, gripper
            )
        )
        found = {
            name: (study.weights(weights), changes)
            for name, (weights, changes) in sides.items()
        }
        self.samplers = {
            name: Sampler(weights, changes, bank)
            for name, (weights, changes) in found.items()
            if weights is not None
        }
        config = dataclasses.replace(PAPER_PLANNER, method=method, lanes=1)
        self._planners = {
            p: _planner(study, dataclasses.replace(config, p_uniform=p))
            for p in (*p_uniform, 1.0)
        }
        self.sides = [Side(n, p) for p in p_uniform for n in self.samplers]
        self.sides.append(Side(UNIFORM, 1.0))
        self.smoothed = self.sides[0]
        """Of this side the whole episode is timed, smoothing included."""
        self.first_calls: dict[str, float] = {}
        for side in self.sides:
            start = time.perf_counter()
            self._warm(side)
            self.first_calls[name_of(*side)] = time.perf_counter() - start
        start = time.perf_counter()
        self.predict(0)
        self.first_calls["upper network"] = time.perf_counter() - start

    def _warm(self, side: Side) -> None:
        """Plans phases until one has drawn segments: an easy one leaves programs uncompiled."""
        for row in [0, *np.flatnonzero(self.problems.blocked)]:
            learned = self.plan(int(row), side)[3]
            if learned or side.name not in self.samplers:
                return

    def condition(self, row: int) -> tuple[Cond, jax.Array]:
        """Of one problem, and its key."""
        cond = jax.tree.map(lambda leaf: jnp.asarray(leaf[[row]]), self.cond)
        return cond, self.keys[jnp.asarray([row])]

    def predict(self, row: int) -> float:
        """Seconds of the upper network."""
        p = self.problems
        one = p.image[[row]], p.q[[row]], p.gripper[[row]]
        start = time.perf_counter()
        jax.block_until_ready(self._upper(*one))
        return time.perf_counter() - start

    def plan(self, row: int, side: Side) -> list[float]:
        """Plans a phase.

        Returns:
            Seconds of the search with its banks, of the banks alone, of smoothing;
            learned proposals used, and 1 where it was solved.
        """
        p = self.problems
        world = jax.tree.map(lambda leaf: jnp.asarray(leaf[[row]]), p.worlds)
        ends = p.q_start[[row]], p.q_goal[[row]], p.q_toggle[[row]]
        cond, key = self.condition(row)
        draw, sampler = None, self.samplers.get(side.name)
        if sampler is not None:
            sampler.seconds, draw = 0.0, sampler.of(cond, key)
        motion, smoothing = self._planners[side.p_uniform], 0.0
        start = time.perf_counter()
        result = jax.block_until_ready(motion.search(world, *ends, key, draw))
        search = time.perf_counter() - start
        banks = sampler.seconds if sampler else 0.0
        if side == self.smoothed:
            # Once more, since `plan` also looks for free neighbours of start and goal.
            start = time.perf_counter()
            made = motion.plan(world, *ends, key, draw)
            smoothing = time.perf_counter() - start - made.seconds
        return [
            search,
            banks,
            smoothing,
            float(result.learned[0]),
            float(result.status[0] == Status.SOLVED),
        ]


def _planner(study: RecordedStudy, config: PlannerConfig) -> MotionPlanner:
    return MotionPlanner(study.scene, study.task.robot.limits, config)


def episode(bench: Bench, seed: int) -> dict[str, Any]:
    """Sums over an episode's phases, of each side."""
    rows = np.flatnonzero(bench.problems.seed == seed)
    upper, sums = 0.0, {side: np.zeros(5) for side in bench.sides}
    for row in rows.tolist():
        upper += bench.predict(row)
        for side in bench.sides:
            sums[side] += bench.plan(row, side)
    return {
        "seed": seed,
        "phases": len(rows),
        "upper": upper,
        "sides": {name_of(*side): total.tolist() for side, total in sums.items()},
    }


def prices(bench: Bench) -> dict[str, Any]:
    """Seconds of one proposal of each sampler, and of the first calls."""
    cond, key = bench.condition(0)
    return {
        "seconds_per_proposal": {
            name: sampler.proposal(cond, key)
            for name, sampler in bench.samplers.items()
        },
        "first_call_seconds": bench.first_calls,
    }


def name_of(sampler: str, p_uniform: float) -> str:
    return f"{sampler}, p_uniform {p_uniform}"

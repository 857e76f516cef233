"""The door to planning: checks what it is given, runs the search, refills the bank.

    plan = make_planner(motion_free, config_free, config, q_min, q_max)
    result = plan(worlds, q_start, q_goal, q_toggle, keys, draw)

Every piece compiles once for a batch size P and a bank size M. `worlds` is an argument of the
compiled pieces, so a world may change from call to call; a batch that is short of problems is
padded and `active` says which lanes are real.
"""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.config import PlannerConfig
from jaxplan.planning import search
from jaxplan.planning.result import PlanResult
from jaxplan.planning.segment import Segment
from jaxplan.planning.state import Query, State, searching

Worlds = Any


def make_planner(
    motion_free: Callable[[Worlds, jax.Array, jax.Array, jax.Array], jax.Array],
    config_free: Callable[[Worlds, jax.Array, jax.Array], jax.Array],
    config: PlannerConfig,
    q_min,
    q_max,
    jit: Callable[[Callable], Callable] = jax.jit,
) -> Callable[..., PlanResult]:
    """Builds a planner for batches of problems.

    Args:
        motion_free: `(worlds, problem [R], q0 [R, d], q1 [R, d]) -> [R]`: whether straight
            motions are free, row r in the world of problem `problem[r]`.
        config_free: `(worlds, problem [R], q [R, d]) -> [R]`.
        config: Planner settings.
        q_min: `[d]` lower joint limits [rad].
        q_max: `[d]` upper joint limits [rad].
        jit: Compiles the pieces; give compiler options here.

    Returns:
        `plan(worlds, q_start [P, d], q_goal [P, d], q_toggle [P, d], keys [P], draw=None,
        active=None) -> PlanResult`. `draw(chunk [P]) -> Segment [P, M]` gives the learned
        segments `chunk * M` to `chunk * M + M - 1` of each problem; without it all
        proposals are uniform. `active [P]` is false for padding lanes.

    Raises:
        ValueError: A setting or a limit that makes no sense, or arrays of the wrong shape.
    """
    q_min, q_max = np.asarray(q_min, np.float32), np.asarray(q_max, np.float32)
    _check_settings(config, q_min, q_max)
    d = q_min.size

    @jit
    def start(worlds: Worlds, query: Query, active: jax.Array) -> State:
        def free(problem, q):
            return config_free(worlds, problem, q)

        return search.start(query, active, free, _limits(), config)

    @jit
    def grow(worlds: Worlds, state: State, bank: Segment | None) -> State:
        def free(problem, q0, q1):
            return motion_free(worlds, problem, q0, q1)

        return search.grow(state, bank, free, _limits(), config)

    @jit
    def finish(state: State) -> PlanResult:
        return search.finish(state, config)

    @jit
    def unfinished(state: State) -> jax.Array:
        return jnp.any(searching(state, config))

    def _limits():
        return jnp.asarray(q_min), jnp.asarray(q_max)

    def plan(
        worlds: Worlds, q_start, q_goal, q_toggle, keys, draw=None, active=None
    ) -> PlanResult:
        query = Query(
            _batch(q_start, d, "q_start"),
            _batch(q_goal, d, "q_goal"),
            _batch(q_toggle, d, "q_toggle"),
            keys,
        )
        problems = query.q_start.shape[0]
        if {len(q) for q in query} != {problems}:
            sizes = [len(q) for q in query]
            raise ValueError(f"q_start, q_goal, q_toggle, keys have lengths {sizes}")
        active = (
            jnp.ones(problems, bool) if active is None else jnp.asarray(active, bool)
        )
        state = start(worlds, query, active)
        if draw is None or config.p_uniform >= 1:
            return finish(grow(worlds, state, None))
        chunk = jnp.zeros(problems, jnp.int32)
        while unfinished(state):
            bank = draw(chunk)
            state = grow(worlds, state, bank)
            chunk = state.control.used // bank.length.shape[1]
        return finish(state)

    return plan


def _batch(q, d: int, name: str) -> jax.Array:
    q = jnp.asarray(q, jnp.float32)
    if q.ndim != 2 or q.shape[1] != d:
        raise ValueError(f"{name} has shape {q.shape}, expected (problems, {d})")
    return q


def _check_settings(
    config: PlannerConfig, q_min: np.ndarray, q_max: np.ndarray
) -> None:
    """Refuses settings under which the search would be wrong without a word."""
    if q_min.ndim != 1 or q_min.shape != q_max.shape or not np.all(q_min < q_max):
        raise ValueError(
            f"joint limits must be finite with q_min < q_max: {q_min} {q_max}"
        )
    if not (np.isfinite(q_min).all() and np.isfinite(q_max).all()):
        raise ValueError(
            f"joint limits must be finite with q_min < q_max: {q_min} {q_max}"
        )
    if config.method not in search.METHODS:
        raise ValueError(f"method {config.method!r}, expected {sorted(search.METHODS)}")
    if config.uniform_mode not in ("toward", "independent"):
        raise ValueError(f"uniform_mode {config.uniform_mode!r}: toward or independent")
    if config.goal_tree not in ("mirrored", "uniform"):
        raise ValueError(f"goal_tree {config.goal_tree!r}: mirrored or uniform")
    for name in ("max_expansions", "proposals", "check_rows"):
        if getattr(config, name) < 1:
            raise ValueError(f"{name} {getattr(config, name)}, expected at least 1")
    for name in ("p_uniform", "goal_bias"):
        if not 0 <= getattr(config, name) <= 1:
            raise ValueError(f"{name} {getattr(config, name)}, expected 0 to 1")
    for name in ("goal_tolerance", "goal_connect", "toggle_tie_break"):
        if not 0 <= getattr(config, name) < math.inf:
            raise ValueError(f"{name} {getattr(config, name)}, expected 0 or more")
    if not 0 < config.step_min <= config.step_max < math.inf:
        steps = f"{config.step_min}, {config.step_max}"
        raise ValueError(f"step_min, step_max {steps}, expected 0 < min <= max")
    if config.metric is not None and (
        len(config.metric) != q_min.size or not min(config.metric) > 0
    ):
        raise ValueError(
            f"metric {config.metric}, expected {q_min.size} positive weights"
        )

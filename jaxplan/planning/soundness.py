"""Whether what a search begins with and what it has found is free."""

from functools import partial

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.edges import ConfigFree, all_free
from jaxplan.planning.result import PlanResult
from jaxplan.planning.search import rows_for
from jaxplan.planning.space import norm
from jaxplan.planning.state import Problem
from jaxplan.planning.sweep import SweptFree, sweep

PIECE = 1 / 16
"""Of a path that is to be proven free [rad]."""


def check_ends_and_paths(
    problems: Problem,
    problem: jax.Array,
    found: PlanResult,
    opening: jax.Array,
    solved: jax.Array,
    checks: tuple[ConfigFree, SweptFree | None],
    config: PlannerConfig,
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Checks paths, starts and goals in one pass.

    Args:
        problems: `[L]`.
        problem: `[L]` their numbers, for `checks`.
        found: `[L]` paths.
        opening: `[L]` whose start and goal are to be checked.
        solved: `[L]` whose path is.
        checks: Of configurations, and of all that lies within a motion, if there is one.
        config: Planner settings.

    Returns:
        `[L]` each: path sound, start free, goal free; true where nothing was asked.
    """
    config_free, swept_free = checks
    count, waypoints, d = found.path.shape
    dense = config.path_resolution > 0
    gaps = norm(found.path[:, 1:] - found.path[:, :-1])
    spacing = config.path_resolution if swept_free is None else PIECE
    places = jnp.ceil(gaps / spacing) if dense else 0 * gaps
    edge = jnp.arange(waypoints - 1)
    counts = jnp.where(
        solved[:, None] & (edge < found.path_length[:, None] - 1) & dense,
        jnp.maximum(places, 1).astype(jnp.int32),
        0,
    )
    lane = jnp.arange(count, dtype=jnp.int32)
    both = jnp.concatenate(problems[:2])
    check = partial(all_free, config_free)
    if swept_free is not None:
        check = partial(sweep, swept_free)
    free = check(
        problem[jnp.concatenate([jnp.repeat(lane, waypoints - 1), lane, lane])],
        jnp.concatenate([found.path[:, :-1].reshape(-1, d), both]),
        jnp.concatenate([found.path[:, 1:].reshape(-1, d), both]),
        jnp.concatenate([counts.reshape(-1), opening, opening], dtype=jnp.int32),
        rows_for(count, config),
    )
    paths, start_free, goal_free = jnp.split(free, [counts.size, counts.size + count])
    return paths.reshape(counts.shape).all(1), start_free, goal_free

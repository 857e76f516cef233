"""Both ends of a search: what the problems are worth, and what is read out of the trees."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.config import PlannerConfig
from jaxplan.planning.methods import method_of
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.space import Space
from jaxplan.planning.state import Problem, State
from jaxplan.planning.tree import extract_path, sizes

LIMIT_SLACK = 1e-4
"""How far a start or goal may lie outside the limits [rad]: rounding, no more."""
MAX_WAYPOINTS = 512
"""A longer path does not count as found."""


def examine(problems: Problem, space: Space) -> tuple[Problem, jax.Array]:
    """Checks all of the problems but for collisions.

    Args:
        problems: `[P]`.
        space: Of the configurations.

    Returns:
        The problems, finite everywhere, and `[P]` statuses: BUDGET_EXHAUSTED where there is
        something to search.
    """
    given = jnp.stack([*problems[:3], *jnp.moveaxis(problems.goals, 1, 0)])
    finite = jnp.all(jnp.isfinite(given), axis=(0, 2))
    inside = np.clip(0.0, space.q_min, space.q_max)
    given = jnp.where(finite[:, None], given, inside)
    q_start, q_goal, q_toggle = given[:3]
    goals = jnp.moveaxis(given[3:], 0, 1)
    problems = Problem(q_start, q_goal, q_toggle, problems.key, problems.bound, goals)
    ends = jnp.stack([q_start, q_goal, *given[3:]])
    over = (ends < space.q_min - LIMIT_SLACK) | (ends > space.q_max + LIMIT_SLACK)
    over = jnp.any(over, axis=(0, 2))
    status = jnp.where(over, Status.OUT_OF_LIMITS, Status.BUDGET_EXHAUSTED)
    status = jnp.where(finite, status, Status.INVALID_INPUT)
    return problems, status.astype(jnp.int32)


def waypoints(config: PlannerConfig) -> int:
    """W: room for the longest path that there can be, up to `MAX_WAYPOINTS`."""
    return min(config.max_expansions + 2, MAX_WAYPOINTS)


def finish(state: State, space: Space, config: PlannerConfig) -> PlanResult:
    """Reads the paths out of the trees."""
    method = method_of(config)
    node, joint = method.ends(state.tree, state.control, state.problems, space)
    searched = state.status <= Status.BUDGET_EXHAUSTED
    node, joint = jnp.where(searched, node, -1), jnp.where(searched, joint, -1)
    path, path_length = extract_path(state.tree, node, joint, waypoints(config))
    path = space.unwound(path)
    cut = path_length > path.shape[1]
    return PlanResult(
        path=path,
        path_length=jnp.minimum(path_length, path.shape[1]),
        status=jnp.where(cut, Status.BUDGET_EXHAUSTED, state.status),
        expansions=state.expansions,
        accepted=state.accepted,
        learned=state.used,
        checks=state.checks,
        nodes=sizes(state.tree),
    )

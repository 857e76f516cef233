"""The search loop: many proposals checked in one call, the tree of one at a time.

An algorithm (`rrt`, `rrt_connect`) is a machine with discrete control. From its control it
proposes one move; the verdict on that move gives the next control. A round takes K moves:

    speculate  runs the machine K moves ahead as if every motion were free; no collision calls
    check      the motions of all P problems in one call of `check_rows` rows. K is what
               fits: 1 while many problems search, up to `proposals` for the last few
    settle     commits moves in order, as long as the machine alone would have made them:
               every earlier move was committed; the base is not a rejected node; and the
               move before was either free, as assumed, or its verdict changes nothing that
               follows (`fork` false)

A base that was nearest among the tree and the speculated nodes is nearest among those of
them that stand, if it stands. So the committed moves are those of K = 1, with the same
random numbers (methods.md section 6.4), and `expansions` counts sequential expansions.

For example, K = 4 in an RRT, each base in brackets:  a(root) b(a) c(root) d(b), b blocked:
a and c are added, b is counted as rejected, d is proposed anew since its base fell away.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning import rrt, rrt_connect
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.segment import Limits, Segment
from jaxplan.planning.speculation import settle, speculate
from jaxplan.planning.state import Query, State, searching
from jaxplan.planning.tree import extract_path, plant

METHODS = {"rrt": rrt, "rrt_connect": rrt_connect}
LIMIT_SLACK = 1e-4
"""How far a start or goal may lie outside the limits [rad]: rounding, no more."""

MotionFree = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]
ConfigFree = Callable[[jax.Array, jax.Array], jax.Array]


def start(
    query: Query,
    active: jax.Array,
    config_free: ConfigFree,
    limits: Limits,
    config: PlannerConfig,
) -> State:
    """Checks the questions and plants the trees.

    Args:
        query: P problems.
        active: `[P]` false for padding lanes.
        config_free: `(problem [R], q [R, d]) -> [R]`.
        limits: `(q_min [d], q_max [d])` [rad].
        config: Planner settings.

    Returns:
        A state in which only sound, active problems are searching.
    """
    lane = jnp.arange(query.q_start.shape[0], dtype=jnp.int32)
    ends = jnp.stack([query.q_start, query.q_goal])
    given = jnp.concatenate([ends, query.q_toggle[None]])
    finite = jnp.all(jnp.isfinite(given), axis=(0, 2))
    middle = 0.5 * (limits[0] + limits[1])
    query = query._replace(
        q_start=jnp.where(finite[:, None], query.q_start, middle),
        q_goal=jnp.where(finite[:, None], query.q_goal, middle),
        q_toggle=jnp.where(finite[:, None], query.q_toggle, middle),
    )
    ends = jnp.stack([query.q_start, query.q_goal])
    over = (ends < limits[0] - LIMIT_SLACK) | (ends > limits[1] + LIMIT_SLACK)
    rows = ends.reshape(-1, ends.shape[-1])
    free = config_free(jnp.tile(lane, 2), rows).reshape(2, -1)

    method = METHODS[config.method]
    control = method.begin(query, config)
    status = jnp.where(control.solved, Status.SOLVED, Status.BUDGET_EXHAUSTED)
    status = jnp.where(free[1], status, Status.GOAL_IN_COLLISION)
    status = jnp.where(free[0], status, Status.START_IN_COLLISION)
    status = jnp.where(jnp.any(over, axis=(0, 2)), Status.OUT_OF_LIMITS, status)
    status = jnp.where(finite, status, Status.INVALID_INPUT)
    status = jnp.where(active, status, Status.INACTIVE).astype(jnp.int32)
    return State(
        query=query,
        tree=plant(method.roots(query), config.max_expansions + 2),
        control=control,
        status=status,
        waiting=jnp.zeros_like(active),
        expansions=jnp.zeros_like(lane),
        accepted=jnp.zeros_like(lane),
        checked=jnp.zeros_like(lane),
        flags=jnp.zeros((lane.size, config.max_expansions), bool),
    )


def grow(
    state: State,
    bank: Segment | None,
    motion_free: MotionFree,
    limits: Limits,
    config: PlannerConfig,
) -> State:
    """Searches until every problem is at its end or waits for more learned segments.

    Args:
        state: From `start` or an earlier `grow`.
        bank: `[P, M]` segments, of each problem those from `chunk * M` on, with
            `chunk = state.control.used // M`. None: uniform proposals only.
        motion_free: `(problem [R], q0 [R, d], q1 [R, d]) -> [R]`.
        limits: `(q_min [d], q_max [d])` [rad].
        config: Planner settings.

    Returns:
        The state; problems that wait are those still `searching`.
    """
    method = METHODS[config.method]
    lane = jnp.arange(state.status.size, dtype=jnp.int32)
    ahead = lane.size * config.proposals
    room = max(lane.size, min(ahead, config.check_rows))
    first = state.control.used if bank is None else _chunk_start(state, bank)

    def able(state: State) -> jax.Array:
        return searching(state, config) & ~state.waiting

    def round_(state: State) -> State:
        depth = room // jnp.maximum(jnp.sum(able(state)), 1)
        depth = jnp.minimum(depth, config.proposals)
        trial = speculate(method, state, bank, first, depth, limits, config)
        asked = (trial.running & trial.possible).reshape(ahead)
        (rows,) = jnp.nonzero(asked, size=room, fill_value=0)
        q0, q1 = (q.reshape(ahead, -1)[rows] for q in (trial.q_base, trial.q_new))
        verdict = motion_free(rows % lane.size, q0, q1)
        free = asked & verdict[jnp.clip(jnp.cumsum(asked) - 1, 0)]
        return settle(method, state, trial, free.reshape(trial.running.shape), config)

    state = state._replace(waiting=jnp.zeros_like(state.waiting))
    return jax.lax.while_loop(lambda s: jnp.any(able(s)), round_, state)


def _chunk_start(state: State, bank: Segment) -> jax.Array:
    """`[P]` number of the first segment in the bank."""
    rows = bank.length.shape[1]
    return state.control.used // rows * rows


def finish(state: State, config: PlannerConfig) -> PlanResult:
    """Reads the paths out of the trees."""
    method = METHODS[config.method]
    node, joint = method.ends(state.tree, state.control, state.query, config)
    searched = state.status <= Status.BUDGET_EXHAUSTED
    node, joint = jnp.where(searched, node, -1), jnp.where(searched, joint, -1)
    path, path_length = extract_path(state.tree, node, joint)
    return PlanResult(
        path=path,
        path_length=path_length,
        status=state.status,
        expansions=state.expansions,
        accepted=state.accepted,
        learned=state.control.used,
        checked=state.checked,
        flags=state.flags,
        tree=state.tree,
    )

"""What a search carries: the questions, the control of each worker, and the counters."""

from typing import NamedTuple

import jax

from jaxplan.config import PlannerConfig
from jaxplan.planning.result import Status
from jaxplan.planning.segment import Proposal
from jaxplan.planning.tree import Tree


class Query(NamedTuple):
    """P planning problems."""

    q_start: jax.Array
    """`[P, d]` [rad]."""
    q_goal: jax.Array
    """`[P, d]` [rad]."""
    q_toggle: jax.Array
    """`[P, d]` where the gripper toggles; only the tie-break looks at it [rad]."""
    key: jax.Array
    """`[P]` typed keys."""
    bound: jax.Array
    """`[P]` a path has to be shorter than this [rad]; only `ao_rrt_connect` looks at it."""


class Control(NamedTuple):
    """Where each of the K workers of P problems stands in its algorithm; all of it discrete."""

    side: jax.Array
    """`[P, K]` the tree that moves next."""
    connecting: jax.Array
    """`[P, K]` the next move is a straight step and not a proposal of the mixture."""
    chained: jax.Array
    """`[P, K]` the next move starts from the worker's newest node, not from the nearest."""
    newest: jax.Array
    """`[P, K]` the node that the worker added last."""
    aim: jax.Array
    """`[P, K]` node that RRT-Connect's straight steps lead to."""
    solved: jax.Array
    """`[P, K]` this worker has found the way."""


class Move(NamedTuple):
    """What an algorithm wants to try next."""

    proposal: Proposal
    learned: jax.Array
    """`[P, K]` the proposal is a learned segment."""


class Outcome(NamedTuple):
    """How moves came out, `[P, K]` each."""

    accepted: jax.Array
    slot: jax.Array
    """The node that it became if it was accepted."""
    q_base: jax.Array
    """`[P, K, d]`."""
    q_new: jax.Array
    """`[P, K, d]`."""
    reached: jax.Array
    """q_new is the target itself."""


class State(NamedTuple):
    """A search between two calls of `grow`."""

    query: Query
    tree: Tree
    control: Control
    status: jax.Array
    """`[P]` a `Status`; BUDGET_EXHAUSTED from the start on until it is solved."""
    waiting: jax.Array
    """`[P]` the next moves need learned segments that the bank does not have."""
    chunk: jax.Array
    """`[P]` which bank comes next, or is in use."""
    used: jax.Array
    """`[P]` learned segments used so far."""
    tried: jax.Array
    """`[P]` learned proposals so far."""
    kept: jax.Array
    """`[P]` those of them whose motion was free."""
    expansions: jax.Array
    accepted: jax.Array
    checks: jax.Array


def searching(state: State, config: PlannerConfig) -> jax.Array:
    """`[P]` which problems still have something to do."""
    open_ = state.status == Status.BUDGET_EXHAUSTED
    return open_ & (state.expansions < config.max_expansions)

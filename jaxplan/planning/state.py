"""What a search carries: the questions, the control of the algorithm, and the counters."""

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


class Control(NamedTuple):
    """Where each of P problems stands in its algorithm; all of it discrete."""

    side: jax.Array
    """`[P]` the tree that moves next."""
    connecting: jax.Array
    """`[P]` the next move is a straight step and not a proposal of the mixture."""
    chained: jax.Array
    """`[P]` the next move starts from the newest node and not from the nearest."""
    aim: jax.Array
    """`[P]` node that RRT-Connect's straight steps lead to."""
    used: jax.Array
    """`[P]` learned segments used so far."""
    solved: jax.Array
    """`[P]`."""


class Move(NamedTuple):
    """What an algorithm wants to try next."""

    proposal: Proposal
    learned: jax.Array
    """`[P]` the proposal is a learned segment."""


class Outcome(NamedTuple):
    """How a move came out; `slot` is where its node went if it was accepted."""

    accepted: jax.Array
    slot: jax.Array
    q_base: jax.Array
    q_new: jax.Array
    reached: jax.Array
    """`[P]` q_new is the target itself."""


class State(NamedTuple):
    """A search between two calls of `grow`."""

    query: Query
    tree: Tree
    control: Control
    status: jax.Array
    """`[P]` a `Status`; BUDGET_EXHAUSTED from the start on until it is solved."""
    waiting: jax.Array
    """`[P]` the next move needs a learned segment that the bank does not have."""
    expansions: jax.Array
    accepted: jax.Array
    checked: jax.Array
    flags: jax.Array
    """`[P, max_expansions]`."""


def searching(state: State, config: PlannerConfig) -> jax.Array:
    """`[P]` which problems still have something to do."""
    open_ = state.status == Status.BUDGET_EXHAUSTED
    return open_ & (state.expansions < config.max_expansions)

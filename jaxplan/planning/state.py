"""What a search carries: the problems, the control of each worker, and the counters."""

from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.result import Status
from jaxplan.planning.segment import Proposal
from jaxplan.planning.tree import Tree

T = TypeVar("T")


class Problem(NamedTuple):
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
    goals: jax.Array
    """`[P, G - 1, d]` goals beside q_goal that are as good; only `rrt_connect` looks at
    them [rad]."""


class Control(NamedTuple):
    """Where each of the K workers of P problems stands in its algorithm."""

    side: jax.Array
    """`[P, K]` the tree that moves next."""
    connecting: jax.Array
    """`[P, K]` the next move is a straight step to `q_aim` and not a proposal of the mixture."""
    following: jax.Array
    """`[P, K]` the straight steps lead on to what a proposal stepped toward."""
    chained: jax.Array
    """`[P, K]` the next move starts from the worker's newest node, not from the nearest."""
    newest: jax.Array
    """`[P, K]` the node that the worker added last."""
    aim: jax.Array
    """`[P, K]` node of the other tree that RRT-Connect's straight steps lead to."""
    q_aim: jax.Array
    """`[P, K, d]` where straight steps lead [rad]."""
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
    target: jax.Array
    """`[P, K, d]`."""
    follows: jax.Array
    """The steps go on until they are there or blocked, unless the trees are being connected."""


class State(NamedTuple):
    """A search between two rounds."""

    problems: Problem
    tree: Tree
    control: Control
    status: jax.Array
    """`[P]` a `Status`; BUDGET_EXHAUSTED from the start on until it is solved."""
    waiting: jax.Array
    """`[P]` the next moves need learned segments that the bank does not have."""
    bank_number: jax.Array
    """`[P]` which bank comes next, or is in use."""
    used: jax.Array
    """`[P]` learned segments used so far."""
    expansions: jax.Array
    accepted: jax.Array
    checks: jax.Array
    attempt: jax.Array
    """`[P]` paths that were refused so far; motions are checked twice as finely after each."""


def searching(state: State, config: PlannerConfig) -> jax.Array:
    """`[P]` which problems still have something to do."""
    open_ = state.status == Status.BUDGET_EXHAUSTED
    return open_ & (state.expansions < config.max_expansions)


def choose(where: jax.Array, new: T, old: T) -> T:
    """Rows of `new` where `where [P]` or `[P, K]`, of `old` elsewhere, in all leaves."""

    def leaf(a: jax.Array, b: jax.Array) -> jax.Array:
        mask = where.reshape(where.shape + (1,) * (a.ndim - where.ndim))
        return jnp.where(mask, a, b)

    return jax.tree.map(leaf, new, old)

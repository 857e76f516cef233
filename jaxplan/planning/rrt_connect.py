"""RRT-Connect with segments: two trees that grow in turn and run at each other.

    grow:     a proposal of the mixture in tree `side`; accepted -> connect, else swap
    connect:  straight steps of the other tree to the new node; blocked -> that tree grows
    solved:   the two trees meet

The start's tree grows as in Algorithm 1. The goal's tree mirrors it: base nearest to
q_start, learned directions reversed, since the sampler knows paths from start to goal only.
The first thing tried is the straight motion from q_start to q_goal.
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import Draw, mixture
from jaxplan.planning.segment import Segment, straightened
from jaxplan.planning.state import Control, Move, Outcome, Query
from jaxplan.planning.tree import Tree, at, nearest

START, GOAL = 0, 1


def roots(query: Query) -> jax.Array:
    """`[P, 2, d]` one tree at q_start and one at q_goal."""
    return jnp.stack([query.q_start, query.q_goal], axis=1)


def begin(query: Query, config: PlannerConfig) -> Control:
    """The start's tree connects to the root of the goal's tree."""
    del config
    zero = jnp.zeros(query.q_start.shape[0], jnp.int32)
    no = jnp.zeros_like(zero, bool)
    return Control(zero, ~no, no, zero + GOAL, zero, no)


def asks(control: Control, draw: Draw, config: PlannerConfig) -> jax.Array:
    """`[P]` whether the next move needs a learned segment."""
    learns = (config.goal_tree == "mirrored") | (control.side == START)
    return ~control.connecting & draw.learned & learns


def propose(
    control: Control,
    tree: Tree,
    draw: Draw,
    asking: jax.Array,
    segment: Segment,
    query: Query,
    config: PlannerConfig,
) -> Move:
    """A proposal of the mixture, mirrored in the goal's tree, or the next straight step."""
    forward = (control.side == START)[:, None]
    towards = jnp.where(forward, query.q_goal, query.q_start)
    direction = jnp.where(forward, segment.direction, -segment.direction)
    segment = Segment(direction, segment.length)
    proposal, learned = mixture(draw, asking, segment, towards, config)
    q_aim = at(tree.q, control.aim)
    move = straightened(proposal, control.connecting, q_aim, config.step_max)
    return Move(move, learned)


def advance(
    control: Control, outcome: Outcome, query: Query, config: PlannerConfig
) -> Control:
    """What follows an accepted or a rejected move."""
    del query, config
    ok, was = outcome.accepted, control.connecting
    met = was & ok & outcome.reached
    return control._replace(
        side=jnp.where(was, control.side, 1 - control.side),
        connecting=ok & ~met,
        chained=was & ok & ~met,
        aim=jnp.where(~was & ok, outcome.slot, control.aim),
        solved=met,
    )


def ends(
    tree: Tree, control: Control, query: Query, config: PlannerConfig
) -> tuple[jax.Array, jax.Array]:
    """The node where the trees meet, in either tree; unsolved: the best one, and none."""
    best = nearest(tree, jnp.zeros_like(control.side), query.q_goal, config.metric)
    newest, forward = tree.size - 1, control.side == START
    node = jnp.where(forward, newest, control.aim)
    joint = jnp.where(forward, control.aim, newest)
    return (
        jnp.where(control.solved, node, best),
        jnp.where(control.solved, joint, -1),
    )

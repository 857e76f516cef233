"""RRT-Connect with segments: two trees that grow in turn and run at each other.

    grow:     a proposal of the mixture in tree `side`; accepted -> connect, else swap
    follow:   straight steps on to the end of a learned segment that has a base, or to any
              sample if `greedy`; there or blocked -> connect
    connect:  straight steps of the other tree to the new node; blocked -> that tree grows
    solved:   the two trees meet

This is what one worker does; several of them share the trees. The start's tree grows as
in Algorithm 1. The goal's tree mirrors it: base nearest to q_start, learned directions
reversed, since the sampler knows paths from start to goal only. The first thing that the
first worker tries is the straight motion from q_start to q_goal.
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import Draw, mixture
from jaxplan.planning.segment import Segment, straightened
from jaxplan.planning.state import Control, Move, Outcome, Query, choose
from jaxplan.planning.tree import Tree, nearest

START, GOAL = 0, 1


def roots(query: Query) -> jax.Array:
    """`[P, 2, d]` one tree at q_start and one at q_goal."""
    return jnp.stack([query.q_start, query.q_goal], axis=1)


def begin(query: Query, config: PlannerConfig) -> Control:
    """One worker connects the start's tree to the goal's root; the others grow, in turn."""
    shape = len(query.q_start), config.workers
    zero, worker = jnp.zeros(shape, jnp.int32), jnp.arange(config.workers)
    no = jnp.zeros(shape, bool)
    side = jnp.broadcast_to((worker % 2).astype(jnp.int32), shape)
    q_aim = jnp.broadcast_to(query.q_goal[:, None], (*shape, query.q_goal.shape[-1]))
    return Control(side, no | (worker == 0), no, no, zero, zero + GOAL, q_aim, no)


def asks(control: Control, draw: Draw, config: PlannerConfig) -> jax.Array:
    """`[P, K]` whether the next move needs a learned segment."""
    learns = (config.goal_tree == "mirrored") | (control.side == START)
    return ~control.connecting & draw.learned & learns


def propose(
    control: Control,
    draw: Draw,
    asking: jax.Array,
    segment: Segment,
    query: Query,
    config: PlannerConfig,
) -> Move:
    """A proposal of the mixture, mirrored in the goal's tree, or the next straight step."""
    forward = control.side == START
    segment = choose(forward, segment, segment.reversed())
    root = jnp.where(forward[..., None], query.q_goal[:, None], query.q_start[:, None])
    proposal, learned = mixture(draw, asking, segment, root, config)
    move = straightened(proposal, control.connecting, control.q_aim, config.step_max)
    return Move(move, learned)


def advance(
    control: Control, outcome: Outcome, query: Query, config: PlannerConfig
) -> Control:
    """What follows an accepted or a rejected move."""
    del query, config
    ok, was = outcome.accepted, control.connecting & ~control.following
    met = was & ok & outcome.reached
    following = ok & outcome.follows & ~outcome.reached
    grown = ~was & ~following & (ok | control.following)
    newest = jnp.where(ok, outcome.slot, control.newest)
    q_newest = jnp.where(ok[..., None], outcome.q_new, outcome.q_base)
    q_aim = jnp.where(following[..., None], outcome.target, control.q_aim)
    onward = was & ok & ~met
    return Control(
        side=jnp.where(was | following, control.side, 1 - control.side),
        connecting=following | grown | onward,
        following=following,
        chained=following | onward,
        newest=newest,
        aim=jnp.where(grown, newest, control.aim),
        q_aim=jnp.where(grown[..., None], q_newest, q_aim),
        solved=met,
    )


def ends(
    tree: Tree, control: Control, query: Query, config: PlannerConfig
) -> tuple[jax.Array, jax.Array]:
    """`[P]` the node where the trees meet, in either tree; unsolved: the best one, and none."""
    side = jnp.zeros_like(control.side[:, :1])
    best = nearest(tree, side, query.q_goal[:, None], config.metric)[0][:, 0]
    first = jnp.argmax(control.solved, axis=1)[:, None]
    newest, aim, side = (
        jnp.take_along_axis(leaf, first, axis=1)[:, 0]
        for leaf in (control.newest, control.aim, control.side)
    )
    node = jnp.where(side == START, newest, aim)
    joint = jnp.where(side == START, aim, newest)
    solved = jnp.any(control.solved, axis=1)
    return jnp.where(solved, node, best), jnp.where(solved, joint, -1)

"""RRT-Connect with segments: two trees that grow in turn and run at each other.

    grow:     a proposal of the mixture in tree `side`; accepted -> connect, else grow
    follow:   straight steps on to the end of a learned segment that has a base, or to any
              sample if `greedy`; there or blocked -> connect
    connect:  straight steps of the other tree to the new node; blocked -> grow
    solved:   the two trees meet

This is what one worker does; several of them share the trees. The start's tree grows as
in Algorithm 1. The goal's tree mirrors it: base nearest to q_start, learned directions
reversed, since the sampler knows paths from start to goal only. The first thing that the
first worker tries is the straight motion from q_start to q_goal. The trees grow in turn;
with `balance` the smaller one until it has half of the other's nodes, since a tree in a
narrow place needs most of the tries.
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.method import Method
from jaxplan.planning.proposal import Draw, mixture
from jaxplan.planning.segment import Segment, straightened
from jaxplan.planning.space import Space
from jaxplan.planning.state import Control, Move, Outcome, Problem, choose
from jaxplan.planning.tree import Tree, at, nearest, sizes

START, GOAL = 0, 1


def roots(problems: Problem) -> jax.Array:
    """`[P, 1 + G, d]` one tree at q_start, and one at q_goal and the other goals."""
    ends = jnp.stack([problems.q_start, problems.q_goal], axis=1)
    return jnp.concatenate([ends, problems.goals], axis=1)


def begin(problems: Problem, space: Space, config: PlannerConfig) -> Control:
    """A worker for each goal connects the start's tree to it; the others grow, in turn."""
    del space
    shape = len(problems.q_start), config.workers
    zero, worker = jnp.zeros(shape, jnp.int32), jnp.arange(config.workers)
    no = jnp.zeros(shape, bool)
    side = jnp.broadcast_to((worker % 2).astype(jnp.int32), shape)
    ends = roots(problems)
    straight = worker < ends.shape[1] - 1
    aim = jnp.broadcast_to(jnp.where(straight, worker + GOAL, GOAL), shape)
    q_aim = ends[:, aim[0]]
    side = jnp.where(straight, START, side)
    return Control(side, no | straight, no, no, zero, aim, q_aim, no)


def asks(control: Control, draw: Draw, config: PlannerConfig) -> jax.Array:
    """`[P, K]` whether the next move needs a learned segment."""
    learns = (config.goal_tree == "mirrored") | (control.side == START)
    return ~control.connecting & draw.learned & learns


def propose(
    control: Control,
    draw: Draw,
    asking: jax.Array,
    segment: Segment,
    problems: Problem,
    config: PlannerConfig,
) -> Move:
    """A proposal of the mixture, mirrored in the goal's tree, or the next straight step."""
    forward = control.side == START
    segment = choose(forward, segment, segment.reversed())
    root = jnp.where(
        forward[..., None], problems.q_goal[:, None], problems.q_start[:, None]
    )
    proposal, learned = mixture(draw, asking, segment, root, config)
    move = straightened(proposal, control.connecting, control.q_aim, config.step_max)
    return Move(move, learned)


def advance(
    control: Control,
    outcome: Outcome,
    problems: Problem,
    tree: Tree,
    space: Space,
    config: PlannerConfig,
) -> Control:
    """What follows an accepted or a rejected move."""
    del problems, space
    ok, was = outcome.accepted, control.connecting & ~control.following
    met = was & ok & outcome.reached
    following = ok & outcome.follows & ~outcome.reached
    grown = ~was & ~following & (ok | control.following)
    newest = jnp.where(ok, outcome.slot, control.newest)
    q_newest = jnp.where(ok[..., None], outcome.q_new, outcome.q_base)
    q_aim = jnp.where(following[..., None], outcome.target, control.q_aim)
    onward = was & ok & ~met
    # Whoever grew or was blocked goes over to the other tree: to connect, or to grow it.
    side = 1 - control.side
    if config.balance:
        # A tree that has less than half of the other's nodes goes on growing.
        own = jnp.where(was, side, control.side)
        count, other = (at(sizes(tree), s) for s in (own, 1 - own))
        grows = jnp.where(other < 2 * count, 1 - own, own)
        side = jnp.where(grown, side, grows)
    else:
        side = jnp.where(was, control.side, side)
    return Control(
        # `ends` reads from the side in which tree the newest node is.
        side=jnp.where(onward | following | met, control.side, side),
        connecting=following | grown | onward,
        following=following,
        chained=following | onward,
        newest=newest,
        aim=jnp.where(grown, newest, control.aim),
        q_aim=jnp.where(grown[..., None], q_newest, q_aim),
        solved=met,
    )


def ends(
    tree: Tree, control: Control, problems: Problem, space: Space
) -> tuple[jax.Array, jax.Array]:
    """`[P]` the node where the trees meet, in either tree; unsolved: the best one, and none."""
    side = jnp.zeros_like(control.side[:, :1])
    best = nearest(tree, side, problems.q_goal[:, None], space)[0][:, 0]
    first = jnp.argmax(control.solved, axis=1)[:, None]
    newest, aim, side = (
        jnp.take_along_axis(leaf, first, axis=1)[:, 0]
        for leaf in (control.newest, control.aim, control.side)
    )
    node = jnp.where(side == START, newest, aim)
    joint = jnp.where(side == START, aim, newest)
    solved = jnp.any(control.solved, axis=1)
    return jnp.where(solved, node, best), jnp.where(solved, joint, -1)


RRT_CONNECT = Method(roots, begin, asks, propose, advance, ends, goal_sets=True)
AO_RRT_CONNECT = RRT_CONNECT._replace(optimises=True, goal_sets=False)

"""RRT as in Algorithm 1, with the goal-connect rule as a switch; what one worker does.

grow:     a proposal of the mixture; accepted within `goal_connect` of q_goal -> connect
follow:   straight steps on to the end of a learned segment that has a base, or to any
          sample if `greedy`; there or blocked -> grow
connect:  straight steps from the newest node to q_goal; blocked -> grow
solved:   a node within `goal_tolerance` of q_goal and nothing left to connect
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.method import Method
from jaxplan.planning.proposal import Draw, mixture
from jaxplan.planning.segment import Segment, straightened
from jaxplan.planning.space import Space
from jaxplan.planning.state import Control, Move, Outcome, Problem
from jaxplan.planning.tree import Tree, nearest


def roots(problems: Problem) -> jax.Array:
    """`[P, 1, d]` the only tree starts at q_start."""
    return problems.q_start[:, None]


def begin(problems: Problem, space: Space, config: PlannerConfig) -> Control:
    """The root is the first accepted node, and the first worker's."""
    shape = len(problems.q_start), config.workers
    zero, first = jnp.zeros(shape, jnp.int32), jnp.arange(config.workers) == 0
    gap = space.distance(problems.q_start, problems.q_goal)[:, None]
    connecting = first & (gap > 0) & (gap <= config.goal_connect)
    solved = first & ~connecting & (gap <= config.goal_tolerance)
    no = jnp.zeros(shape, bool)
    q_aim = jnp.broadcast_to(
        problems.q_goal[:, None], (*shape, problems.q_goal.shape[-1])
    )
    return Control(zero, connecting, no, connecting, zero, zero, q_aim, solved)


def asks(control: Control, draw: Draw, config: PlannerConfig) -> jax.Array:
    """`[P, K]` whether the next move needs a learned segment."""
    del config
    return ~control.connecting & draw.learned


def propose(
    control: Control,
    draw: Draw,
    asking: jax.Array,
    segment: Segment,
    problems: Problem,
    config: PlannerConfig,
) -> Move:
    """A proposal of the mixture, or the next straight step."""
    q_goal = problems.q_goal[:, None]
    proposal, learned = mixture(draw, asking, segment, q_goal, config)
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
    del tree
    ok, q_goal = outcome.accepted, problems.q_goal[:, None]
    gap_new = space.distance(outcome.q_new, q_goal)
    gap_base = space.distance(outcome.q_base, q_goal)
    was = control.connecting & ~control.following
    close = was | (gap_new <= config.goal_connect)
    connecting = ok & close & (gap_new > 0)
    following = ok & ~close & outcome.follows & ~outcome.reached
    # a blocked connection ends at its base, which may be near enough already
    gap = jnp.where(ok, gap_new, jnp.where(was, gap_base, jnp.inf))
    return control._replace(
        connecting=connecting | following,
        following=following,
        chained=connecting | following,
        newest=jnp.where(ok, outcome.slot, control.newest),
        q_aim=jnp.where(following[..., None], outcome.target, q_goal),
        solved=~connecting & (gap <= config.goal_tolerance),
    )


def ends(
    tree: Tree, control: Control, problems: Problem, space: Space
) -> tuple[jax.Array, jax.Array]:
    """The best node reached, q_reach, and no second tree to go on in; `[P]` each."""
    side = jnp.zeros_like(control.side[:, :1])
    best = nearest(tree, side, problems.q_goal[:, None], space)[0][:, 0]
    return best, jnp.full_like(best, -1)


RRT = Method(roots, begin, asks, propose, advance, ends)

"""RRT as in Algorithm 1, with the goal-connect rule as a switch.

grow:     a proposal of the mixture; accepted within `goal_connect` of q_goal -> connect
connect:  straight steps from the newest node to q_goal; blocked -> grow
solved:   a node within `goal_tolerance` of q_goal and nothing left to connect
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import Draw, mixture
from jaxplan.planning.segment import Segment, straightened
from jaxplan.planning.state import Control, Move, Outcome, Query
from jaxplan.planning.tree import Tree, distance, nearest


def roots(query: Query) -> jax.Array:
    """`[P, 1, d]` the only tree starts at q_start."""
    return query.q_start[:, None]


def begin(query: Query, config: PlannerConfig) -> Control:
    """The root is the first accepted node."""
    zero = jnp.zeros(query.q_start.shape[0], jnp.int32)
    gap = distance(query.q_start, query.q_goal, config.metric)
    connecting = (gap > 0) & (gap <= config.goal_connect)
    solved = ~connecting & (gap <= config.goal_tolerance)
    return Control(zero, connecting, connecting, zero, zero, solved)


def asks(control: Control, draw: Draw, config: PlannerConfig) -> jax.Array:
    """`[P]` whether the next move needs a learned segment."""
    del config
    return ~control.connecting & draw.learned


def propose(
    control: Control,
    tree: Tree,
    draw: Draw,
    asking: jax.Array,
    segment: Segment,
    query: Query,
    config: PlannerConfig,
) -> Move:
    """A proposal of the mixture, or the next straight step to q_goal."""
    del tree
    proposal, learned = mixture(draw, asking, segment, query.q_goal, config)
    move = straightened(proposal, control.connecting, query.q_goal, config.step_max)
    return Move(move, learned)


def advance(
    control: Control, outcome: Outcome, query: Query, config: PlannerConfig
) -> Control:
    """What follows an accepted or a rejected move."""
    ok = outcome.accepted
    gap_new = distance(outcome.q_new, query.q_goal, config.metric)
    gap_base = distance(outcome.q_base, query.q_goal, config.metric)
    close = control.connecting | (gap_new <= config.goal_connect)
    connecting = ok & close & (gap_new > 0)
    # a blocked connection ends at its base, which may be near enough already
    gap = jnp.where(ok, gap_new, jnp.where(control.connecting, gap_base, jnp.inf))
    return control._replace(
        connecting=connecting,
        chained=connecting,
        solved=~connecting & (gap <= config.goal_tolerance),
    )


def ends(
    tree: Tree, control: Control, query: Query, config: PlannerConfig
) -> tuple[jax.Array, jax.Array]:
    """The best node reached, q_reach, and no second tree to go on in."""
    side = jnp.zeros_like(control.side)
    best = nearest(tree, side, query.q_goal, config.metric)
    return best, jnp.full_like(best, -1)

"""Paths shorter than a bound: what turns RRT-Connect into an asymptotically optimal planner.

`ao_rrt_connect` finds a path, then searches anew for one that is shorter, until its budget
is used (Hauser and Zhou, Asymptotically Optimal Planning by Feasible Kinodynamic Planning
in a State-Cost Space, 2016; AORRTC, Wilson et al., 2025, does the same with RRT-Connect).
A search under a bound

    samples    the ellipsoid of configurations through which a shorter path may lead
               (Gammell et al., Informed RRT*, 2014), and a cost with each
    extends    the nearest node from which the sample costs no more than that
    refuses    nodes through which no path within the bound leads

While the bound is infinite, it is plain RRT-Connect.
"""

import jax
import jax.numpy as jnp

from jaxplan.planning.proposal import Draw
from jaxplan.planning.space import Space, dot, norm, rounded
from jaxplan.planning.state import Control, Problem
from jaxplan.planning.tree import Tree, at


def informed(
    draw: Draw, problems: Problem, side: jax.Array, space: Space
) -> tuple[Draw, jax.Array]:
    """The draw with its sample inside the ellipsoid, and the most that the sample may cost.

    Args:
        draw: Random numbers of `[P, K]` workers.
        problems: `[P]`.
        side: `[P, K]` the tree that moves.
        space: Of the configurations. Where joints come round there are many ways to the goal,
            and no ellipsoid holds them all: the whole space is sampled then.

    Returns:
        The draw, and `[P, K]` a cost, counted from the root of the tree that moves.
    """
    start, goal = problems.q_start[:, None], problems.q_goal[:, None]
    d = start.shape[-1]
    # The uniform numbers that gave q_rand are free: the ellipsoid has its own.
    uniform = draw.uniform
    ball = draw.segment.direction * uniform[..., :1] ** (1 / d)
    gap = goal - start
    across = norm(gap)[..., None]
    bound = problems.bound[:, None]
    long = jnp.maximum(bound[..., None], across)
    finite = jnp.where(jnp.isfinite(long), long, 1.0)
    short = jnp.sqrt(jnp.maximum(finite**2 - across**2, 0))
    axes = jnp.where(jnp.arange(d) == 0, finite, short) / 2
    # A reflection that takes the first axis to the line between the foci.
    first = jnp.eye(d)[0]
    mirror = gap / jnp.maximum(across, 1e-9) - first
    scale = jnp.maximum(dot(mirror, mirror), 1e-12)
    local = axes * ball
    turned = local - rounded(2 * mirror * (dot(mirror, local) / scale)[..., None])
    inside = space.project((start + goal) / 2 + turned)
    narrow = jnp.isfinite(bound)
    q_rand = draw.q_rand
    if not space.turns:
        q_rand = jnp.where(narrow[..., None], inside, q_rand)

    own, other = _roots(problems, side)
    least = space.distance(q_rand, own)
    room = bound - space.distance(q_rand, other) - least
    share = uniform[..., min(1, d - 1)]
    most = jnp.where(narrow, least + share * room, jnp.inf)
    return draw._replace(q_rand=q_rand), most


def admits(
    cost: jax.Array,
    q_new: jax.Array,
    reached: jax.Array,
    control: Control,
    tree: Tree,
    problems: Problem,
    space: Space,
) -> jax.Array:
    """`[P, K]` whether a path within the bound may lead through new nodes.

    Args:
        cost: `[P, K]` of the nodes, from the root of their tree [rad].
        q_new: `[P, K, d]` the nodes.
        reached: `[P, K]` they are what their moves aimed at.
        control: Of the workers.
        tree: Search trees.
        problems: `[P]`.
        space: Of the configurations.
    """
    _, other = _roots(problems, control.side)
    rest = space.distance(q_new, other)
    meets = control.connecting & ~control.following & reached
    rest = jnp.where(meets, at(tree.cost, control.aim), rest)
    return cost + rest < problems.bound[:, None]


def _roots(problems: Problem, side: jax.Array) -> tuple[jax.Array, jax.Array]:
    """`[P, K, d]` the root of the tree that moves, and that of the other."""
    forward = (side == 0)[..., None]
    start, goal = problems.q_start[:, None], problems.q_goal[:, None]
    return jnp.where(forward, start, goal), jnp.where(forward, goal, start)

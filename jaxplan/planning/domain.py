"""Dynamic domains: nodes that often fail are given nearer samples.

A node in a corner, or deep in a shelf, is nearest to a great part of the space, and nearly
all motions toward it are blocked. After its first failure a node takes samples from a ball
around it only, which shrinks with each failure and grows with each success (Yershova,
Jaillet, Simeon and LaValle, Dynamic-Domain RRTs, 2005; Jaillet et al., Adaptive Tuning, 2005).
There a sample outside the ball is thrown away. Here the ball gives another one in its place,
since a worker that waits costs as much as one that works.
"""

import jax
import jax.numpy as jnp

from jaxplan.planning.proposal import Draw
from jaxplan.planning.segment import Proposal
from jaxplan.planning.space import Space, rounded
from jaxplan.planning.tree import Tree

CHANGE = 1e-3
"""By which share a domain shrinks at a failure and grows at a success."""


def nearer(
    proposal: Proposal,
    draw: Draw,
    q_base: jax.Array,
    outside: jax.Array,
    domain: jax.Array,
    space: Space,
) -> Proposal:
    """The proposal with another target, from the ball, where the sample is `outside` of it.

    Args:
        proposal: Moves of K workers of P problems.
        draw: Their random numbers.
        q_base: `[P, K, d]` the nodes [rad].
        outside: `[P, K]` whose sample is replaced.
        domain: `[P, K]` radii of the nodes' domains [rad].
        space: Of the configurations.
    """
    d = q_base.shape[-1]
    radius = domain * draw.share ** (1 / d)
    length = jnp.where(outside, radius, 0.0)[..., None]
    offset = rounded(length * draw.segment.direction)
    target = jnp.where(
        outside[..., None], space.project(q_base + offset), proposal.target
    )
    return proposal._replace(target=target)


def adapted(
    tree: Tree,
    node: jax.Array,
    failed: jax.Array,
    grew: jax.Array,
    widest: float,
    least: float,
) -> Tree:
    """The tree with the domains of nodes `[P, K]` changed by what came of their moves.

    Args:
        tree: Search trees.
        node: `[P, K]` from which the moves went.
        failed: `[P, K]` which were blocked.
        grew: `[P, K]` which became nodes.
        widest: The domain after a node's first failure [rad].
        least: No domain is smaller [rad].
    """
    problem = jnp.arange(node.shape[0])[:, None]
    change = jnp.where(failed, 1 - CHANGE, jnp.where(grew, 1 + CHANGE, 1.0))
    domain = tree.domain.at[problem, node].min(jnp.where(failed, widest, jnp.inf))
    domain = domain.at[problem, node].multiply(change)
    domain = domain.at[problem, node].max(jnp.where(failed, least, 0.0))
    return tree._replace(domain=domain)

"""Base-node conditioning (TreeContext): which segment of a bank suits the node that is extended.

A bank is drawn before there is a tree. If its segments say where they are meant to begin,
the ones that begin near the base can be told from the others, without a network in the loop.
"""

import jax
import jax.numpy as jnp

from jaxplan.planning.segment import Segment

SHARE = 0.25
"""Of a bank's segments that an expansion looks at: the nearest of all would be the same one
again where it was rejected."""


def fitting(
    bank: Segment,
    q_base: jax.Array,
    reversed_: jax.Array,
    keys: jax.Array,
    expansion: jax.Array,
) -> jax.Array:
    """`[P, K]` the row of the bank whose segment begins nearest to the base.

    Args:
        bank: `[P, M]` segments with bases.
        q_base: `[P, K, d]` nodes to be extended [rad].
        reversed_: `[P, K]` the segment will be used backward, from its end to its base.
        keys: `[P]` typed keys of the problems.
        expansion: `[P, K]` numbers of the expansions.
    """
    assert bank.base is not None
    ends = bank.base + bank.length[..., None] * bank.direction
    begins = jnp.where(reversed_[..., None, None], ends[:, None], bank.base[:, None])
    gaps = jnp.linalg.norm(begins - q_base[:, :, None], axis=-1)
    gaps = jnp.where(jnp.isfinite(gaps), gaps, jnp.inf)

    def one(key: jax.Array, k: jax.Array) -> jax.Array:
        key = jax.random.fold_in(jax.random.fold_in(key, k), 1)
        return jax.random.uniform(key, gaps.shape[-1:])

    looked_at = jax.vmap(jax.vmap(one, (None, 0)))(keys, expansion) < SHARE
    looked_at |= ~looked_at.any(axis=-1, keepdims=True)
    return jnp.argmin(jnp.where(looked_at, gaps, jnp.inf), axis=-1)

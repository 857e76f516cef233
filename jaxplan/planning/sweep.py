"""Are straight motions free all along? Proofs by bisection, without gaps.

A piece of a motion is proven where every configuration as near to its middle as its ends
are is free (`collision.config_free` with `motion`). What is not proven is halved, down to
pieces so short that their middle decides.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp

SweptFree = Callable[[jax.Array, jax.Array, jax.Array], jax.Array]
"""`(problem [R], q [R, d], motion [R, d]) -> [R]`: True proves that all configurations
within `motion` of q, joint by joint, are free, row r in the world of problem `problem[r]`."""

SHORTEST = 2e-4
"""Pieces in which no joint moves more than this are decided by their middle [rad or m]."""
DEPTH = 24
"""Halvings that there is room for: pieces of 1000 rad come down to the shortest."""


def sweep(
    swept_free: SweptFree,
    problem: jax.Array,
    q0: jax.Array,
    q1: jax.Array,
    pieces: jax.Array,
    rows: int,
) -> jax.Array:
    """Whether straight motions are free, both ends included.

    Args:
        swept_free: The check of configurations and what is near to them.
        problem: `[M]` whose world each motion is in.
        q0: `[M, d]` starts [rad].
        q1: `[M, d]` ends [rad].
        pieces: `[M]` into how many equal pieces each motion is cut to begin with; 0 = it is
            not looked at, and counts as free.
        rows: Pieces of one call of `swept_free`.

    Returns:
        `[M]` bool.
    """
    ends, last = jnp.cumsum(pieces), len(pieces) - 1
    room = rows * DEPTH
    span = jnp.abs(q1 - q0)
    index = jnp.arange(rows, dtype=jnp.int32)

    def more(carry: tuple) -> jax.Array:
        begun, top, *_ = carry
        return (begun < ends[-1]) | (top > 0)

    def step(carry: tuple) -> tuple:
        begun, top, stack, free = carry
        # Halves first, from the newest on, so that there are never many; then new pieces.
        old = (top >= rows) | (begun >= ends[-1])
        row = begun + index
        new_motion = jnp.minimum(jnp.searchsorted(ends, row, side="right"), last)
        parts = jnp.maximum(pieces[new_motion], 1)
        new_at = (row - (ends - pieces)[new_motion]) / parts
        taken = top - 1 - index
        stacked = [leaf[jnp.maximum(taken, 0)] for leaf in stack]
        motion = jnp.where(old, stacked[0], new_motion)
        at = jnp.where(old, stacked[1], new_at)
        width = jnp.where(old, stacked[2], 1 / parts)
        real = jnp.where(old, taken >= 0, row < ends[-1]) & free[motion]

        half = 0.5 * width[:, None] * span[motion]
        short = jnp.max(half, axis=-1) <= 0.5 * SHORTEST
        middle = (at + 0.5 * width)[:, None]
        q = q0[motion] + middle * (q1[motion] - q0[motion])
        proven = swept_free(problem[motion], q, jnp.where(short[:, None], 0.0, half))
        open_ = real & ~proven
        top = jnp.where(old, jnp.maximum(top - rows, 0), top)
        place = top + 2 * (jnp.cumsum(open_ & ~short) - 1)
        full = place + 1 >= room
        refused = open_ & (short | full)
        free = free.at[jnp.where(refused, motion, last + 1)].set(False, mode="drop")
        halved = open_ & ~refused
        for side in range(2):
            where = jnp.where(halved, place + side, room)
            values = motion, at + 0.5 * side * width, 0.5 * width
            stack = [
                leaf.at[where].set(value, mode="drop")
                for leaf, value in zip(stack, values, strict=True)
            ]
        top = top + 2 * jnp.sum(halved, dtype=jnp.int32)
        begun = jnp.where(old, begun, begun + rows)
        return begun, top, stack, free

    zero = jnp.int32(0)
    stack = [jnp.zeros(room, jnp.int32), jnp.zeros(room), jnp.zeros(room)]
    free = jnp.ones(pieces.shape, bool)
    return jax.lax.while_loop(more, step, (zero, zero, stack, free))[3]

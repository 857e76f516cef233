"""Are straight motions free? Few checks for those that are not.

Most motions that a search tries are blocked, and most of these at their end. So all ends
are checked first, then a few points of each survivor, then the rest of those that still
stand. Between stages the survivors are packed together: a round costs what it checks.
"""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

ConfigFree = Callable[[jax.Array, jax.Array], jax.Array]
"""`(problem [R], q [R, d]) -> [R]` whether configurations are free, row r in the world of
problem `problem[r]`."""

COARSE = 4
"""The second stage looks at the inner points of this many equal parts."""


def points_for(length: float, resolution: float) -> int:
    """Configurations to check so that none of their gaps exceeds `resolution` [rad]."""
    return max(1, math.ceil(length / resolution - 1e-9))


def stages(points: int) -> list[np.ndarray]:
    """Shares of a motion in the order in which they are checked, all of (1..points)/points."""
    every = np.arange(1, points + 1)
    coarse = np.unique(np.arange(1, COARSE) * points // COARSE)
    coarse = coarse[(coarse > 0) & (coarse < points)]
    rest = np.setdiff1d(every[:-1], coarse)
    groups = [every[-1:], coarse, rest]
    return [group.astype(np.float32) / points for group in groups if len(group)]


def motions_free(
    config_free: ConfigFree,
    problem: jax.Array,
    q0: jax.Array,
    q1: jax.Array,
    asked: jax.Array,
    points: int,
    rows: int,
) -> tuple[jax.Array, jax.Array]:
    """Checks straight motions at `points` even places, the end among them and the start not.

    Args:
        config_free: The check of configurations.
        problem: `[M]` whose world each motion is in.
        q0: `[M, d]` starts [rad].
        q1: `[M, d]` ends [rad].
        asked: `[M]` which motions to check; the others come out as not free.
        points: Checked configurations per motion.
        rows: Configurations of one call of `config_free`, about.

    Returns:
        `[M]` whether each motion is free, and `[M]` how many of its configurations were
        checked.
    """
    groups = stages(points)
    sizes = np.array([len(group) for group in groups], np.int32)
    table = np.stack([np.resize(group, sizes.max()) for group in groups])
    motions = asked.size

    def stage(s: jax.Array, carry: tuple[jax.Array, jax.Array]):
        free, checks = carry
        size = jnp.asarray(sizes)[s]
        (index,) = jnp.nonzero(free, size=motions, fill_value=0)
        total = jnp.sum(free, dtype=jnp.int32) * size

        def block(i: jax.Array, free: jax.Array) -> jax.Array:
            row = i * rows + jnp.arange(rows, dtype=jnp.int32)
            motion = index[jnp.minimum(row // size, motions - 1)]
            share = jnp.asarray(table)[s, row % size][:, None]
            start, end = q0[motion], q1[motion]
            # The end itself, not what rounding makes of it.
            q = jnp.where(share == 1, end, start + share * (end - start))
            blocked = (row < total) & ~config_free(problem[motion], q)
            return free.at[jnp.where(blocked, motion, motions)].set(False, mode="drop")

        blocks = (total + rows - 1) // rows
        return jax.lax.fori_loop(0, blocks, block, free), checks + free * size

    # A loop over the stages, so that the check is compiled once.
    nothing = jnp.zeros(asked.shape, jnp.int32)
    return jax.lax.fori_loop(0, len(groups), stage, (asked, nothing))


def all_free(
    config_free: ConfigFree,
    problem: jax.Array,
    q0: jax.Array,
    q1: jax.Array,
    counts: jax.Array,
    rows: int,
) -> jax.Array:
    """Checks straight motions at places that differ in number, none of them left out.

    Args:
        config_free: The check of configurations.
        problem: `[M]` whose world each motion is in.
        q0: `[M, d]` starts [rad].
        q1: `[M, d]` ends [rad].
        counts: `[M]` how many places of each motion to check, evenly spaced, the end among
            them and the start not; 0 = none, and the motion counts as free.
        rows: Configurations of one call of `config_free`.

    Returns:
        `[M]` bool.
    """
    ends, last = jnp.cumsum(counts), len(counts) - 1

    def block(i: jax.Array, free: jax.Array) -> jax.Array:
        row = i * rows + jnp.arange(rows, dtype=jnp.int32)
        motion = jnp.minimum(jnp.searchsorted(ends, row, side="right"), last)
        back = (ends[motion] - 1 - row) / jnp.maximum(counts[motion], 1)
        q = q1[motion] + back[:, None] * (q0[motion] - q1[motion])
        blocked = (row < ends[-1]) & ~config_free(problem[motion], q)
        return free.at[jnp.where(blocked, motion, last + 1)].set(False, mode="drop")

    blocks = (ends[-1] + rows - 1) // rows
    return jax.lax.fori_loop(0, blocks, block, jnp.ones(counts.shape, bool))

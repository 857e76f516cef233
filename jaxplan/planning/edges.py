"""Are straight motions free? Few checks for those that are not.

Most motions that a search tries are blocked, and most of these at their end. So all ends
are checked first, then a few points of each survivor, then the rest of those that still
stand. Between stages the survivors are packed together: a round costs what it checks.
"""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxplan.ranges import NotNegative, Positive, check

ConfigFree = Callable[[jax.Array, jax.Array], jax.Array]
"""`(problem [R], q [R, d]) -> [R]` whether configurations are free, row r in the world of
problem `problem[r]`."""

COARSE = 4
"""The second stage looks at the inner points of this many equal parts."""
STAGES = 3


def points_for(length: float, resolution: float) -> int:
    """Configurations to check so that none of their gaps exceeds `resolution` [rad]."""
    check("length", length, NotNegative)
    check("resolution", resolution, Positive)
    return max(1, math.ceil(length / resolution - 1e-3))


def places(stage: jax.Array, points: jax.Array) -> jax.Array:
    """How many of a motion's `points [M]` places are checked in a stage."""
    first, coarse = jnp.minimum(points, 1), jnp.clip(points - 1, 0, COARSE - 1)
    rest = jnp.maximum(points - COARSE, 0)
    return jnp.where(stage == 0, first, jnp.where(stage == 1, coarse, rest))


def place(stage: jax.Array, index: jax.Array, points: jax.Array) -> jax.Array:
    """The place, of 1 to `points [M]`, that a stage checks as its `index [M]`-th."""
    few = points <= COARSE
    coarse = jnp.where(few, index + 1, (index + 1) * points // COARSE)
    rest = index + 1
    for k in range(1, COARSE):  # those of the second stage are left out
        rest = rest + (rest >= k * points // COARSE)
    return jnp.where(stage == 0, points, jnp.where(stage == 1, coarse, rest))


def motions_free(
    config_free: ConfigFree,
    problem: jax.Array,
    q0: jax.Array,
    q1: jax.Array,
    points: jax.Array,
    rows: int,
) -> tuple[jax.Array, jax.Array]:
    """Checks straight motions at even places, the end among them and the start not.

    Args:
        config_free: The check of configurations.
        problem: `[M]` whose world each motion is in.
        q0: `[M, d]` starts [rad].
        q1: `[M, d]` ends [rad].
        points: `[M]` how many places of each motion to check; those with none come out as
            not free.
        rows: Configurations of one call of `config_free`, about.

    Returns:
        `[M]` whether each motion is free, and `[M]` how many of its configurations were
        checked.
    """
    motions = points.size

    def stage(s: jax.Array, carry: tuple[jax.Array, jax.Array]):
        free, checks = carry
        counts = jnp.where(free, places(s, points), 0)
        ends = jnp.cumsum(counts)

        def block(i: jax.Array, free: jax.Array) -> jax.Array:
            row = i * rows + jnp.arange(rows, dtype=jnp.int32)
            motion = jnp.sum(ends <= row[:, None], axis=1, dtype=jnp.int32)
            motion = jnp.minimum(motion, motions - 1)
            index = row - (ends - counts)[motion]
            share = place(s, index, points[motion]) / jnp.maximum(points[motion], 1)
            start, end, share = q0[motion], q1[motion], share[:, None]
            # The end itself, not what rounding makes of it.
            q = jnp.where(share == 1, end, start + share * (end - start))
            blocked = (row < ends[-1]) & ~config_free(problem[motion], q)
            return free.at[jnp.where(blocked, motion, motions)].set(False, mode="drop")

        blocks = (ends[-1] + rows - 1) // rows
        return jax.lax.fori_loop(0, blocks, block, free), checks + counts

    # A loop over the stages, so that the check is compiled once.
    nothing = jnp.zeros(points.shape, jnp.int32)
    return jax.lax.fori_loop(0, STAGES, stage, (points > 0, nothing))


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

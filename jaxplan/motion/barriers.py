"""Joints that stand between start and goal: at some position of theirs nothing is free.

An arm whose shoulder turns by 4 pi may still hit its own pedestal at one angle, wherever its
other joints are. No path leads past such an angle, and no search will say so.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.motion.blocks import in_blocks
from jaxplan.planning.space import TURN, Space

SLICES = 24
"""Positions that are tried of a joint, on each way from start to goal."""
FEW, MANY = 8, 512
"""Random configurations at each position, and at one where none of the few is free."""

Free = Callable[[np.ndarray], jax.Array]


class Barrier(NamedTuple):
    """Where a joint cannot pass, as far as random configurations tell."""

    joint: int
    positions: tuple[float, ...]
    """One on the way from start to goal; two where the joint comes round [rad or m]."""
    q: np.ndarray
    """`[M, d]` configurations with the joint at the first of these; none of them is free."""


def barrier_between(
    free: Free, q_start: np.ndarray, q_goals: np.ndarray, space: Space, seed: int = 0
) -> Barrier | None:
    """The joint that hinders the way from a start to all of its goals, if one is found.

    Evidence and no proof: a passage that `MANY` random configurations miss is overlooked, and so
    is a barrier that is thinner than the `SLICES`.

    Args:
        free: `[B, d] -> [B]` bool.
        q_start: `[d]` [rad or m].
        q_goals: `[G, d]` [rad or m].
        space: Of the joints.
        seed: Of the random configurations.
    """
    rng = np.random.default_rng(seed)
    ends = jnp.asarray(q_start), jnp.asarray(q_goals[0])
    low, high = map(np.asarray, space.box(*ends))
    joints = range(len(q_start))
    ways = {j: found for j in joints if (found := _ways(j, q_start, q_goals, space))}

    def shut(joint: int, positions: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
        """Which positions are free in none of some configurations, and these."""
        q = rng.uniform(low, high, (len(positions), count, len(low)))
        q[..., joint] = positions[:, None]
        free_rows = in_blocks(free, q.reshape(-1, len(low)).astype(np.float32)) > 0
        return np.asarray(~free_rows.reshape(q.shape[:2]).any(1)), q

    inside = np.linspace(0, 1, SLICES + 2)[1:-1]
    candidates = []
    for joint, spans in ways.items():
        places = [a + inside * (b - a) for a, b in spans]
        runs = [_longest(shut(joint, at, FEW)[0]) for at in places]
        if all(length for _, length in runs):
            middles = [at[middle] for at, (middle, _) in zip(places, runs, strict=True)]
            candidates.append((runs[0][1], joint, np.array(middles)))
    for _, joint, middles in sorted(candidates, key=lambda each: -each[0]):
        everywhere, q = shut(joint, middles, MANY)
        if everywhere.all():
            return Barrier(joint, tuple(middles.tolist()), q[0])
    return None


def _ways(
    joint: int, q_start: np.ndarray, q_goals: np.ndarray, space: Space
) -> list[tuple[float, float]]:
    """What a joint has to pass on the way to any goal; two such spans where it comes round."""
    start, gaps = float(q_start[joint]), q_goals[:, joint] - q_start[joint]
    if space.circular[joint]:
        gaps = gaps % TURN
        return [(start, start + gaps.min()), (start, start + gaps.max() - TURN)]
    if gaps.min() > 0:
        return [(start, start + gaps.min())]
    return [(start, start + gaps.max())] if gaps.max() < 0 else []


def _longest(shut: np.ndarray) -> tuple[int, int]:
    """The middle of the longest run of True, and its length."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], shut.astype(int), [0]])))
    runs = edges.reshape(-1, 2)
    if not len(runs):
        return 0, 0
    first, end = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    return (first + end - 1) // 2, end - first

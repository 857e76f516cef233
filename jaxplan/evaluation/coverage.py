"""Whether a sampler's proposals cover all ways that a problem can be solved by."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

CLEAR, APART = 0.5, 0.2
"""A proposal belongs to a way if it is nearer to it than this share of its distance to others, and
they are farther than this [rad]: where ways begin and end together it belongs to none."""
ENOUGH = 0.05
"""A way is covered by this share of the proposals."""


class Coverage(NamedTuple):
    """How proposals lie about the ways of one problem."""

    shares: np.ndarray
    """`[W]` of the proposals, that belong to each way."""
    distance: float
    """Median over the proposals, to the nearest way [rad]."""

    @property
    def covered(self) -> np.ndarray:
        """bool `[W]`."""
        return self.shares >= ENOUGH


def coverage(ends: np.ndarray, ways: Sequence[np.ndarray]) -> Coverage:
    """Of proposals that lead to `ends [N, d]`, for ways `[T, d]` [rad]."""
    gaps = np.stack([to_path(ends, way) for way in ways])
    nearest = gaps.min(axis=0)
    others = np.stack(
        [
            np.delete(gaps, i, axis=0).min(axis=0, initial=np.inf)
            for i in range(len(ways))
        ]
    )
    shares = ((gaps < CLEAR * others) & (others > APART)).mean(axis=1)
    return Coverage(shares, float(np.median(nearest)))


def to_path(q: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distances `[N]` of configurations `[N, d]` to the polyline through `path [T, d]` [rad]."""
    start, along = path[:-1], np.diff(path, axis=0)
    from_start = q[:, None] - start
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip((from_start * along).sum(axis=2) / squared, 0, 1)
    gaps = np.linalg.norm(from_start - share[..., None] * along, axis=2)
    return gaps.min(axis=1)

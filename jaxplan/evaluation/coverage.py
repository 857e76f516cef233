"""Whether a sampler's proposals cover all ways that a problem can be solved by."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

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


def coverage(
    lost: np.ndarray, ends: np.ndarray, ways: Sequence[np.ndarray]
) -> Coverage:
    """A proposal belongs to the one way whose closing takes it away.

    Where ways begin and end together it belongs to none, and what no way goes through, the mean
    of two, is lost with neither, or with both.

    Args:
        lost: bool `[N, W]`: proposals that are free, and would not be with a way closed.
        ends: `[N, d]` where they lead [rad].
        ways: `[T, d]` each [rad].
    """
    one = lost & (lost.sum(axis=1, keepdims=True) == 1)
    gaps = np.min([to_path(ends, way) for way in ways], axis=0)
    return Coverage(one.mean(axis=0), float(np.median(gaps)))


def to_path(q: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Distances `[N]` of configurations `[N, d]` to the polyline through `path [T, d]` [rad]."""
    start, along = path[:-1], np.diff(path, axis=0)
    from_start = q[:, None] - start
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip((from_start * along).sum(axis=2) / squared, 0, 1)
    gaps = np.linalg.norm(from_start - share[..., None] * along, axis=2)
    return gaps.min(axis=1)

"""Collision checks of lines and curves through calls of one fixed shape.

Lines and curves need any number of configurations; a jitted `config_free` wants one
shape. So all of them are laid end to end and cut into blocks of `check_rows`, the last
one padded: one compilation, and work that grows only with the length to be checked.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jax.typing import ArrayLike
from scipy.interpolate import BSpline

ConfigFree = Callable[[np.ndarray, np.ndarray], ArrayLike]
"""`(problem: Int[R], q: [R, d]) -> Bool[R]`, called with R = `check_rows` only."""


def points_free(
    config_free: ConfigFree,
    problem: Sequence[int],
    points: Sequence[np.ndarray],
    check_rows: int,
) -> np.ndarray:
    """Whether all configurations of each item are free.

    Args:
        config_free: the collision check of configurations.
        problem: `[K]` the problem (row of the caller's worlds) of each item.
        points: K arrays `[n, d]` of configurations [rad], n >= 1 and any.
        check_rows: R, the number of rows of each call.

    Returns:
        `Bool[K]`.
    """
    if not points:
        return np.zeros(0, bool)
    counts = np.array([len(item) for item in points])
    q = np.concatenate(points)
    rows = np.repeat(np.asarray(problem, np.int32), counts)
    total = len(q)
    filler = np.zeros(-total % check_rows, np.intp)
    q, rows = np.concatenate([q, q[filler]]), np.concatenate([rows, rows[filler]])
    free = np.concatenate(
        [
            np.asarray(config_free(rows[i : i + check_rows], q[i : i + check_rows]))
            for i in range(0, total, check_rows)
        ]
    )[:total]
    starts = np.cumsum(counts) - counts
    return np.logical_and.reduceat(free, starts)


def line_points(a: np.ndarray, b: np.ndarray, resolution: float) -> np.ndarray:
    """Configurations `[n, d]` of the straight line from a to b, both ends included.

    Neighbours lie at most `resolution` [rad] apart.
    """
    steps = max(1, int(np.ceil(np.linalg.norm(b - a) / resolution)))
    return a + np.linspace(0.0, 1.0, steps + 1)[:, None] * (b - a)


def curve_points(curve: BSpline, resolution: float) -> np.ndarray:
    """Configurations `[n, d]` of a curve whose parameter moves no slower than q.

    The first one, where the robot already is, is left out: nothing could be changed.
    """
    length = curve.t[-1]
    steps = max(1, int(np.ceil(length / resolution)))
    return curve(np.linspace(0.0, length, steps + 1)[1:])

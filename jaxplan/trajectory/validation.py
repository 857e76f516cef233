"""Collision checks of curves, without gaps, through calls of one fixed shape.

A curve is a chain of cubic Bezier pieces, and each joint of a piece stays between the
least and the greatest of its control points. So on a piece no joint is further from
where it is in the middle than at some control point; `swept_free` proves that box
around the middle free. A piece that is not proven is cut, until its middle is in
collision or it is too small to matter.

Curves need any number of checks; a jitted function wants one shape. So all that is
asked at a time is laid end to end and cut into blocks of `check_rows`, the last one
padded: one compilation, and work that grows only with what is to be checked.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jax.typing import ArrayLike
from scipy.interpolate import BSpline

from jaxplan.trajectory.spline import bezier

ConfigFree = Callable[[np.ndarray, np.ndarray], ArrayLike]
"""`(problem: Int[R], q: [R, d]) -> Bool[R]`, called with R = `check_rows` only."""
SweptFree = Callable[[np.ndarray, np.ndarray, np.ndarray], ArrayLike]
"""`(problem: Int[R], q: [R, d], motion: [R, d]) -> Bool[R]`, called with R = `check_rows`
only. True proves that every configuration is free whose joints are within `motion` of q; with
motion 0 it says whether q itself is free."""

_SMALLEST = 1e-4  # [rad or m]; where no joint moves further, the middle says it all

_LEFT = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8.0
_MIDDLE = _LEFT[-1]
_HALVES = np.stack([_LEFT, _LEFT[::-1, ::-1]])
"""The control points of a cubic's halves from its own (de Casteljau)."""


@dataclass(frozen=True)
class Validation:
    """Whether configurations and curves are free.

    Attributes:
        config_free: the collision check of configurations.
        swept_free: the proof for all configurations around one. Without it a curve is
            checked at points no more than `resolution` apart.
        check_rows: R, the number of rows of each call.
        resolution: longest piece of a curve that is asked about [rad].
    """

    config_free: ConfigFree
    swept_free: SweptFree | None
    check_rows: int
    resolution: float

    def points_free(
        self, problem: Sequence[int], points: Sequence[np.ndarray]
    ) -> np.ndarray:
        """Whether all configurations of each item are free; see `points_free`."""
        return points_free(self._at_rest, problem, points, self.check_rows)

    def curves_free(
        self, problem: Sequence[int], curves: Sequence[BSpline]
    ) -> np.ndarray:
        """Whether each curve is free all along.

        Args:
            problem: `[K]` the problem (row of the caller's worlds) of each curve.
            curves: K curves of degree 1 or 3.

        Returns:
            `Bool[K]`.
        """
        if not curves:
            return np.zeros(0, bool)
        pieces = [bezier(curve) for curve in curves]
        item = np.repeat(np.arange(len(pieces)), [len(chain) for chain in pieces])
        item, piece = _shorter(item, np.concatenate(pieces), self.resolution)
        world = np.asarray(problem, np.int32)
        free = np.ones(len(curves), bool)
        if self.swept_free is None:
            middle = _MIDDLE @ piece
            free[item[~self._asked(self.config_free, world[item], middle)]] = False
            return free
        # Middles of what was not proven are asked along with its parts: a call less.
        doubted, doubt = item[:0], piece[:0, 0]
        while len(piece) + len(doubt):
            middle = _MIDDLE @ piece
            motion = np.abs(piece - middle[:, None]).max(axis=1)
            answers = self._asked(
                self.swept_free,
                world[np.concatenate([item, doubted])],
                np.concatenate([middle, doubt]),
                np.concatenate([motion, np.zeros_like(doubt)]),
            )
            left, clear = ~answers[: len(item)], answers[len(item) :]
            free[doubted[~clear]] = False
            left &= free[item]
            doubted, doubt = item[left], middle[left]
            left &= motion.max(axis=1) > _SMALLEST
            item, piece = _halved(*_halved(item[left], piece[left]))
        return free

    def _at_rest(self, problem: np.ndarray, q: np.ndarray) -> ArrayLike:
        """Configurations one by one, by the program that is compiled anyway."""
        if self.swept_free is None:
            return self.config_free(problem, q)
        return self.swept_free(problem, q, np.zeros_like(q))

    def _asked(self, check: Callable, *columns: np.ndarray) -> np.ndarray:
        return _in_blocks(check, columns, self.check_rows)


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
    rows = np.repeat(np.asarray(problem, np.int32), counts)
    free = _in_blocks(config_free, (rows, np.concatenate(points)), check_rows)
    return np.logical_and.reduceat(free, np.cumsum(counts) - counts)


def _in_blocks(
    check: Callable, columns: Sequence[np.ndarray], check_rows: int
) -> np.ndarray:
    """`check` of all rows `[n, ...]` of the columns, by calls of `check_rows` rows."""
    total = len(columns[0])
    filler = np.zeros(-total % check_rows, np.intp)
    padded = [np.concatenate([column, column[filler]]) for column in columns]
    answers = [
        np.asarray(check(*(column[i : i + check_rows] for column in padded)))
        for i in range(0, total, check_rows)
    ]
    return np.concatenate([np.zeros(0, bool), *answers])[:total]


def _shorter(
    item: np.ndarray, piece: np.ndarray, length: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cuts pieces `[n, 4, d]`, each of an item `[n]`, until none is longer than that."""
    done = []
    while piece.size:
        polygon = np.linalg.norm(np.diff(piece, axis=1), axis=-1).sum(axis=1)
        long = polygon > length
        done.append((item[~long], piece[~long]))
        item, piece = _halved(item[long], piece[long])
    items, pieces = zip(*done, strict=True)
    return np.concatenate(items), np.concatenate(pieces)


def _halved(item: np.ndarray, piece: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both halves of each piece."""
    halves = (_HALVES @ piece[:, None]).reshape(-1, *piece.shape[1:])
    return np.repeat(item, 2), halves

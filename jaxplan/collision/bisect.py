"""A proof that nothing is too near anywhere on a path, and not only where it was sampled.

A stretch of the path is proven if in its middle every pair of geoms is farther apart than
the two can move against each other on the way to its ends. What is not proven is halved.
Our own distance goes first, many stretches at a time; then C MuJoCo's goes over those that
ours has proven, with a bound of its own for each pair.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxplan.collision.course import Course, Stretches
from jaxplan.collision.rows import clearance_rows

FLOOR = 5e-5
"""Stretches on which nothing moves farther than this are not halved [m]."""
ROUNDING = 1e-5
"""What our own distance, in single precision, may be wrong by [m]."""


class Proof(NamedTuple):
    """What came of it."""

    clearance: float
    """No pair is nearer than this anywhere on the path [m]; -inf if that is not proven."""
    stuck: float
    """A place where it failed; NaN if it did not."""


def prove(course: Course, least: float, most: float) -> Proof:
    """Proves that no pair is nearer than `least`, and how far they are, up to `most` [m]."""
    parts, ours, stuck = _halve(course.pieces, lambda s: _our_gaps(course, s), least)
    if not math.isnan(stuck):
        return Proof(-math.inf, stuck)
    known = float(ours.min(initial=most))
    _, theirs, stuck = _halve(parts, lambda s: _their_gaps(course, s, known), least)
    if not math.isnan(stuck):
        return Proof(-math.inf, stuck)
    return Proof(float(theirs.min(initial=known)), math.nan)


def _halve(
    parts: Stretches, gaps: Callable[[Stretches], np.ndarray], least: float
) -> tuple[Stretches, np.ndarray, float]:
    """Halves stretches until their gaps are at least `least`.

    Args:
        parts: Where to begin.
        gaps: A lower bound on the distance of all pairs, all along each stretch [m].
        least: What is enough [m].

    Returns:
        The stretches that are proven, their gaps, and a place where there is none, or NaN.
    """
    done: list[tuple[np.ndarray, ...]] = []
    while len(parts.low):
        found = gaps(parts)
        good = found >= least
        done.append((*(leaf[good] for leaf in (*parts, found)),))
        failed = np.flatnonzero(~good & (parts.motion <= FLOOR))
        if len(failed):
            worst = failed[np.nan_to_num(found[failed], nan=-math.inf).argmin()]
            return parts, found, float(parts.low[worst] + parts.high[worst]) / 2
        parts = parts.halves(~good)
    if not done:
        return parts, parts.low, math.nan
    low, high, motion, found = map(np.concatenate, zip(*done, strict=True))
    return Stretches(low, high, motion), found, math.nan


def _our_gaps(course: Course, parts: Stretches) -> np.ndarray:
    middle, half = course.middles(parts)
    return clearance_rows(course.scene, course.world, middle, half) - ROUNDING


def _their_gaps(course: Course, parts: Stretches, most: float) -> np.ndarray:
    """C MuJoCo's, as far as `most`."""
    middle, half = course.middles(parts)
    replica, travel = course.replica, course.travel
    replica.load(course.world, middle)
    gaps = np.full(len(middle), most)
    for row in range(len(middle)):
        replica.pose(row)
        sides = travel.sides(half[row])
        # What is farther apart than this is not reported, and need not be.
        reach = max(most + travel.most(sides), 0.0)
        distance, geoms = replica.contacts(reach)
        gap = distance - travel.pair(sides, geoms)
        gaps[row] = gap.min(initial=most)
    return gaps

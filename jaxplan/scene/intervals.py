"""Polynomials on intervals: where they stay inside limits, how steep they are.

Coefficients are in ascending order, as in MuJoCo's polycoef.
"""

from collections.abc import Sequence
from itertools import pairwise, product

import numpy as np
from numpy.polynomial import Polynomial

Interval = tuple[float, float]
"""Closed; either end may be infinite."""

TINY = 1e-9
"""Intervals shorter than this are where a polynomial touches a limit, and rounding."""


def meet(first: Sequence[Interval], second: Sequence[Interval]) -> list[Interval]:
    """Where both are."""
    both = [(max(a, c), min(b, d)) for (a, b), (c, d) in product(first, second)]
    return sorted((low, high) for low, high in both if high - low > TINY)


def preimage(polycoef: Sequence[float], allowed: Sequence[Interval]) -> list[Interval]:
    """All x at which the polynomial is in one of the intervals."""
    p = Polynomial(polycoef)
    bounds = [bound for interval in allowed for bound in interval]
    edges = sorted(x for bound in bounds for x in _roots(p - bound))
    inside: list[Interval] = []
    for low, high in pairwise([-np.inf, *edges, np.inf]):
        value = p(_between(low, high))
        if any(a - TINY <= value <= b + TINY for a, b in allowed):
            joins = bool(inside) and inside[-1][1] == low
            inside.append((inside.pop()[0] if joins else low, high))
    return inside


def image(polycoef: Sequence[float], interval: Interval) -> Interval:
    """The least and the greatest value of the polynomial."""
    values = _extremes(Polynomial(polycoef), interval)
    return min(values), max(values)


def steepest(polycoef: Sequence[float], interval: Interval) -> float:
    """The greatest slope, up or down."""
    return max(map(abs, _extremes(Polynomial(polycoef).deriv(), interval)))


def _extremes(p: Polynomial, interval: Interval) -> list[float]:
    """Values at the ends and where the slope is 0; infinite ones at infinite ends."""
    low, high = interval
    inner = [x for x in _roots(p.deriv()) if low < x < high]
    p = p.trim()
    if p.degree() == 0:
        return [float(p.coef[0])]
    far = [
        np.sign(p.coef[-1]) * np.inf,
        np.sign(p.coef[-1]) * (-1) ** p.degree() * np.inf,
    ]
    ends = [float(p(x)) if np.isfinite(x) else far[bool(x < 0)] for x in (low, high)]
    return [*ends, *(float(p(x)) for x in inner)]


def _roots(p: Polynomial) -> list[float]:
    """Real roots; none of a constant."""
    if not np.isfinite(p.coef).all():
        return []
    roots = p.roots()
    real = roots[np.abs(roots.imag) <= 1e-6 * (1 + np.abs(roots.real))].real
    return sorted(map(float, real[np.isfinite(real)]))


def _between(low: float, high: float) -> float:
    if np.isinf(low):
        return 0.0 if np.isinf(high) else high - 1
    return low + 1 if np.isinf(high) else (low + high) / 2

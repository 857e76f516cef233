"""Curves over a polyline's arc length: the polyline itself and a cubic B-spline.

The spline is Schoenberg's: its control points are the polyline at the Greville
abscissae of clamped, evenly spaced knots. Three laws follow from that choice:

* ends are met exactly, and straight stretches stay straight, at unit speed;
* the curve stays in the convex hull of the waypoints, hence inside joint limits;
* the parameter is the polyline's arc length, and |dq/ds| <= 1 (so samples spaced by
  `resolution` in s are at most that far apart in q).

It cuts a corner by less than the knot spacing, so halving the spacing tends to the
polyline. An interpolating spline would swing out beyond the corner instead.
"""

import numpy as np
from scipy.interpolate import BSpline

_SHORTEST = 1e-9  # [rad]; a motion of no length gets this much parameter range


def arc_length(path: np.ndarray) -> np.ndarray:
    """Arc length `[W]` [rad] at each waypoint of `path` `[W, d]`, from 0."""
    edges = np.linalg.norm(np.diff(path, axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(edges)])


def at_arc_length(path: np.ndarray, s: np.ndarray) -> np.ndarray:
    """The polyline `path` `[W, d]` at arc lengths `s` `[n]`: `[n, d]` [rad]."""
    along = arc_length(path)
    edge = np.clip(np.searchsorted(along, s, side="right") - 1, 0, len(path) - 2)
    length = np.maximum(along[edge + 1] - along[edge], _SHORTEST)
    share = np.clip((s - along[edge]) / length, 0.0, 1.0)[:, None]
    return (1.0 - share) * path[edge] + share * path[edge + 1]


def fit_polyline(path: np.ndarray) -> BSpline:
    """The polyline through `path` `[W, d]` as a curve of degree 1 over arc length."""
    moved = np.linalg.norm(np.diff(path, axis=0), axis=1) > _SHORTEST
    path = np.concatenate([path[:1], path[1:][moved]])
    if len(path) == 1:
        return BSpline([0.0, 0.0, _SHORTEST, _SHORTEST], path[[0, 0]], 1)
    along = arc_length(path)
    return BSpline(np.concatenate([[0.0], along, along[-1:]]), path, 1)


def fit_spline(path: np.ndarray, spline_step: float) -> BSpline:
    """The cubic B-spline that follows `path` `[W, d]`.

    Args:
        path: waypoints [rad].
        spline_step: largest knot spacing [rad].

    Returns:
        A curve of degree 3 over the arc length of `path`.
    """
    length = max(arc_length(path)[-1], _SHORTEST)
    spans = int(np.ceil(length / spline_step))
    breaks = np.linspace(0.0, length, spans + 1)
    knots = np.concatenate([[0.0] * 3, breaks, [length] * 3])
    greville = (knots[1:-3] + knots[2:-2] + knots[3:-1]) / 3.0
    return BSpline(knots, at_arc_length(path, greville), 3)


def bezier(curve: BSpline) -> np.ndarray:
    """Control points `[n, 4, d]` of the cubic pieces of a curve of degree 1 or 3."""
    breaks = np.unique(curve.t)
    q = curve(breaks)
    if curve.k == 1:
        first = last = np.diff(q, axis=0)
    else:
        slope, span = curve(breaks, 1), np.diff(breaks)[:, None]
        first, last = span * slope[:-1], span * slope[1:]
    return np.stack([q[:-1], q[:-1] + first / 3.0, q[1:] - last / 3.0, q[1:]], axis=1)

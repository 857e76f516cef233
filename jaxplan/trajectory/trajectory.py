"""The whole post-processing: shortcut, spline, validation with fallback, timing."""

import enum
from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np
from scipy.interpolate import BSpline

from jaxplan.config import TrajectoryConfig
from jaxplan.trajectory.shortcut import shortcut
from jaxplan.trajectory.spline import fit_polyline, fit_spline
from jaxplan.trajectory.timing import evaluate, time_parameterize
from jaxplan.trajectory.validation import ConfigFree, curve_points, points_free


class Rung(enum.IntEnum):
    """What a trajectory follows: the first of these that passed validation."""

    LINE = 0
    """A straight line, timed as it is."""
    SPLINE = 1
    """The cubic B-spline at `spline_step`."""
    DENSER = 2
    """A cubic B-spline at a half or a quarter of `spline_step`."""
    POLYLINE = 3
    """The shortened path, at rest in its corners."""
    INVALID = 4
    """The polyline too, but a configuration of it is in collision: do not execute."""


class Trajectory(NamedTuple):
    """P timed motions from rest to rest, sampled at the control period.

    Attributes:
        times: `[T]` sampling times [s], from 0.
        q: `[P, T, d]` [rad]; a motion that is over stays at its end.
        qd: `[P, T, d]` [rad/s].
        qdd: `[P, T, d]` [rad/s^2]; the one that holds from each sample on.
        length: `[P]` number of samples up to the end, which is the last of them.
        rung: `[P]` the `Rung` of each.
    """

    times: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    length: np.ndarray
    rung: np.ndarray


def make_trajectory(
    paths: np.ndarray,
    path_length: np.ndarray,
    keys: jax.Array,
    config_free: ConfigFree,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    config: TrajectoryConfig,
) -> Trajectory:
    """Smooths, validates and times P paths (section 4.3).

    Each result depends on its own path, key and world only, not on its neighbours. The
    start is not validated, since the robot is there already; nor are joint limits:
    curves stay in the convex hull of their waypoints.

    Args:
        paths: `[P, W, d]` waypoints [rad], padded behind `path_length`.
        path_length: `[P]` numbers of waypoints; 1 = stay.
        keys: `[P]` typed keys.
        config_free: `(problem: Int[R], q: [R, d]) -> Bool[R]` with `problem` in [0, P),
            always called with R = `config.check_rows`; jitted, it compiles once.
        velocity: `[d]` or `[P, d]` the joints' velocity limits [rad/s].
        acceleration: `[d]` or `[P, d]` their acceleration limits [rad/s^2].
        config: steps, rounds and shares of the limits.
    """
    waypoints = [
        np.array(path[: max(n, 1)], np.float64)
        for path, n in zip(np.asarray(paths), np.asarray(path_length), strict=True)
    ]
    waypoints = shortcut(waypoints, keys, config_free, config)
    curves, rung = _choose_curves(waypoints, config_free, config)
    return _sample(
        curves,
        rung,
        config.velocity_scale * np.asarray(velocity),
        config.acceleration_scale * np.asarray(acceleration),
        config.control_period,
    )


def _choose_curves(
    paths: Sequence[np.ndarray], config_free: ConfigFree, config: TrajectoryConfig
) -> tuple[list[BSpline], np.ndarray]:
    """Goes down the ladder of `Rung` until each curve is free."""
    curves = [fit_polyline(path) for path in paths]
    rung = np.full(len(paths), Rung.INVALID)
    lines = {p for p, path in enumerate(paths) if len(path) <= 2}
    bent = set(range(len(paths))) - lines
    ladder = (
        (Rung.LINE, lines, None),
        (Rung.SPLINE, bent, config.spline_step),
        (Rung.DENSER, bent, config.spline_step / 2),
        (Rung.DENSER, bent, config.spline_step / 4),
        (Rung.POLYLINE, bent, None),
    )
    for step_down, group, spline_step in ladder:
        waiting = [p for p in sorted(group) if rung[p] == Rung.INVALID]
        tried = [
            curves[p] if spline_step is None else fit_spline(paths[p], spline_step)
            for p in waiting
        ]
        points = [curve_points(curve, config.check_resolution) for curve in tried]
        free = points_free(config_free, waiting, points, config.check_rows)
        for p, curve, ok in zip(waiting, tried, free, strict=True):
            if ok:
                curves[p], rung[p] = curve, step_down
    return curves, rung


def _sample(
    curves: Sequence[BSpline],
    rung: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    control_period: float,
) -> Trajectory:
    """Times the curves and samples them, slowed so that each ends on a sample."""
    timing = time_parameterize(curves, velocity, acceleration)
    last = np.ceil(timing.times[:, -1] / control_period).astype(int)
    ticks = np.arange(last.max() + 1)
    samples = [
        # Time runs from 0 to the motion's own duration over its `last` ticks.
        evaluate(curve, s, speed, times, np.minimum(ticks / n, 1.0) * times[-1])
        for curve, s, speed, times, n in zip(
            curves, *timing, np.maximum(last, 1), strict=True
        )
    ]
    q, qd, qdd = (np.stack(rows) for rows in zip(*samples, strict=True))
    slower = timing.times[:, -1] / (np.maximum(last, 1) * control_period)
    return Trajectory(
        times=ticks * control_period,
        q=q,
        qd=qd * slower[:, None, None],
        qdd=qdd * slower[:, None, None] ** 2,
        length=last + 1,
        rung=rung,
    )

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
from jaxplan.trajectory.validation import ConfigFree, SweptFree, Validation


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
    PATH = 4
    """The path as it was found, at rest in its corners."""
    INVALID = 5
    """That too, but a configuration of it is in collision: do not execute."""


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
    circular: np.ndarray | None = None,
    swept_free: SweptFree | None = None,
) -> Trajectory:
    """Smooths, validates and times P paths (section 4.3).

    Each result depends on its own path, key and world only, not on its neighbours.
    Joint limits are not validated: curves stay in the convex hull of their waypoints.

    Args:
        paths: `[P, W, d]` waypoints [rad], padded behind `path_length`; on circular
            joints from one to the next by less than pi.
        path_length: `[P]` numbers of waypoints; 1 = stay.
        keys: `[P]` typed keys.
        config_free: `(problem: Int[R], q: [R, d]) -> Bool[R]` with `problem` in [0, P),
            always called with R = `config.check_rows`; jitted, it compiles once.
        velocity: `[d]` or `[P, d]` the joints' velocity limits [rad/s].
        acceleration: `[d]` or `[P, d]` their acceleration limits [rad/s^2].
        config: steps, rounds and shares of the limits.
        circular: `Bool[d]` joints that live on a circle; a motion may end at full turns
            from where its path does. None = none.
        swept_free: `(problem: Int[R], q: [R, d], motion: [R, d]) -> Bool[R]`, called
            likewise, then instead of `config_free`: True proves all configurations
            free whose joints are within `motion` of q. With it curves are free all
            along, without at points no more than `config.check_resolution` apart.
    """
    found = [
        np.array(path[: max(n, 1)], np.float64)
        for path, n in zip(np.asarray(paths), np.asarray(path_length), strict=True)
    ]
    validation = Validation(
        config_free, swept_free, config.check_rows, config.check_resolution
    )
    short = shortcut(found, keys, validation, config, circular)
    curves, rung = _choose_curves(found, short, validation, config.spline_step)
    return _sample(
        curves,
        rung,
        config.velocity_scale * np.asarray(velocity),
        config.acceleration_scale * np.asarray(acceleration),
        config.control_period,
    )


def _choose_curves(
    found: Sequence[np.ndarray],
    short: Sequence[np.ndarray],
    validation: Validation,
    spline_step: float,
) -> tuple[list[BSpline], np.ndarray]:
    """Goes down the ladder of `Rung` until each curve is free."""
    curves = [fit_polyline(path) for path in found]
    rung = np.full(len(found), Rung.INVALID)
    lines = {p for p, path in enumerate(short) if len(path) <= 2}
    bent = set(range(len(short))) - lines
    ladder = (
        (Rung.LINE, lines, short, None),
        (Rung.SPLINE, bent, short, spline_step),
        (Rung.DENSER, bent, short, spline_step / 2),
        (Rung.DENSER, bent, short, spline_step / 4),
        (Rung.POLYLINE, bent, short, None),
        (Rung.PATH, lines | bent, found, None),
    )
    for step_down, group, paths, spacing in ladder:
        waiting = [p for p in sorted(group) if rung[p] == Rung.INVALID]
        tried = [
            fit_polyline(paths[p]) if spacing is None else fit_spline(paths[p], spacing)
            for p in waiting
        ]
        free = validation.curves_free(waiting, tried)
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

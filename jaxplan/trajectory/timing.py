"""Time-optimal speed along a curve under velocity and acceleration limits (TOPP-RA).

Along q(s) let x = (ds/dt)^2 and u = d2s/dt2. On a grid of s both are linear constraints:

    0 <= x <= min_j (v_j / |q'_j|)^2,     |q'_j u + q''_j x| <= a_j,
    x_{i+1} = x_i + 2 (s_{i+1} - s_i) u_i.

A backward pass finds beta_i, the largest x_i from which rest can still be reached at the
end; a forward pass then takes the largest feasible u_i (Pham and Pham 2018). Each joint
bounds u by two parallel lines of slope -m_j = -q''_j / q'_j around 0, and all bounds of
x are where two such lines meet: so every linear program has a closed form, written here
for all problems at once. Accelerations bind at both ends of each interval (of constant
u), as 2 d lines; what they exceed in between is measured afterwards and taken out by
slowing the whole motion. It is little, as the grid is finer where the curve bends.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

_GRID = 64  # intervals of a curve's timing, at least
_SPAN = {1: 8, 3: 2}  # intervals of a span, at least, by the curve's degree
_RISE = 0.001  # of q'_j above its chord within an interval, at most
_SMALLEST_RATE = 1e-6  # stands for |dq_j/ds| of a joint that does not move
_END = 1.0 - 1e-6  # of an interval: a corner's derivatives are those behind it
_WITHIN = np.array([0.0, 0.25, 0.5, 0.75, _END])  # where limits are measured


class Timing(NamedTuple):
    """A piecewise constant acceleration of s, for P curves.

    Rows shorter than the longest are padded by repeating their last point.

    Attributes:
        s: `[P, N+1]` the grid [rad of arc length].
        speed: `[P, N+1]` ds/dt at the grid [rad/s]; 0 at both ends.
        times: `[P, N+1]` when the grid is passed [s].
    """

    s: np.ndarray
    speed: np.ndarray
    times: np.ndarray


def time_parameterize(
    curves: Sequence[BSpline], velocity: np.ndarray, acceleration: np.ndarray
) -> Timing:
    """The fastest motions from rest to rest along curves.

    A curve of degree 1 also rests at each of its corners.

    Args:
        curves: P curves of degree 1 or 3 over s in [0, length].
        velocity: `[d]` or `[P, d]` largest joint speeds [rad/s].
        acceleration: `[d]` or `[P, d]` largest joint accelerations [rad/s^2].
    """
    grids = [_grid(curve) for curve in curves]
    longest = max(len(s) for s, _ in grids)
    s = np.stack([np.pad(s, (0, longest - len(s)), "edge") for s, _ in grids])
    rest = np.stack([np.pad(r, (0, longest - len(r)), "edge") for _, r in grids])
    velocity = np.broadcast_to(velocity, (len(curves), np.shape(velocity)[-1]))
    acceleration = np.broadcast_to(acceleration, velocity.shape)

    dq, ddq = _derivatives(curves, s)
    x = _fastest(s, rest, dq, ddq, velocity[:, None], acceleration[:, None])
    excess = _excess(s, x, dq, ddq, velocity, acceleration)
    speed = np.sqrt(x / excess[:, None])
    step, mean = np.diff(s), (speed[:, 1:] + speed[:, :-1]) / 2.0
    lasts = np.divide(step, mean, out=np.zeros_like(step), where=step > 0.0)
    return Timing(s, speed, np.pad(np.cumsum(lasts, axis=1), ((0, 0), (1, 0))))


def evaluate(
    curve: BSpline, s: np.ndarray, speed: np.ndarray, times: np.ndarray, t: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, dq/dt and d2q/dt2, each `[n, d]`, at times `t` `[n]` [s] of one timed curve.

    `s`, `speed` and `times` are one row `[N+1]` of a `Timing`. From the end on, the
    motion rests.
    """
    i = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    lasts = times[i + 1] - times[i]
    u = np.divide(speed[i + 1] - speed[i], lasts, out=np.zeros_like(t), where=lasts > 0)
    since = t - times[i]
    at = np.minimum(s[i] + since * (speed[i] + 0.5 * u * since), s[-1])
    ds = np.maximum(speed[i] + u * since, 0.0)
    over = t >= times[-1]
    at, ds, u = np.where(over, s[-1], at), np.where(over, 0.0, ds), np.where(over, 0, u)
    dq, ddq = curve(at, 1), curve(at, 2)
    return curve(at), dq * ds[:, None], ddq * ds[:, None] ** 2 + dq * u[:, None]


def _grid(curve: BSpline) -> tuple[np.ndarray, np.ndarray]:
    """Grid of s and where the motion must rest on it, each `[N+1]`.

    It is finer where a curve bends: q'_j is a parabola on each span, and by as much as
    that rises above its chord the acceleration may rise between an interval's ends.
    """
    breaks = curve.t[curve.k : len(curve.t) - curve.k]
    span = np.diff(breaks)
    rise = np.abs(np.diff(curve(breaks, 2), axis=0)).max(axis=1) * span / 8.0
    least = np.maximum(_SPAN[curve.k], _GRID / len(span))
    # An even number of intervals: the middle of a straight line, where its speed peaks,
    # is then on the grid.
    counts = 2 * np.ceil(np.maximum(np.sqrt(rise / _RISE), least) / 2.0).astype(int)
    share = np.concatenate([np.arange(n) / n for n in counts])
    s = np.repeat(breaks[:-1], counts) + share * np.repeat(span, counts)
    s = np.append(s, breaks[-1])
    rest = np.zeros(len(s), bool)
    rest[[0, *np.cumsum(counts)] if curve.k == 1 else [0, -1]] = True
    return s, rest


def _derivatives(
    curves: Sequence[BSpline], s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative `[P, N, B, d]` at `_WITHIN` of each interval."""
    fine = s[:, :-1, None] + np.diff(s)[..., None] * _WITHIN
    rows = list(zip(curves, fine, strict=True))
    return np.stack([c(r, 1) for c, r in rows]), np.stack([c(r, 2) for c, r in rows])


def _fastest(
    s: np.ndarray,
    rest: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> np.ndarray:
    """x `[P, N+1]` of the fastest motion: the two passes of TOPP-RA."""
    twice = 2.0 * np.diff(s)[..., None]
    # At an interval's end x has become x + 2 step u.
    a, m = _lines(
        np.concatenate([dq[:, :, 0], dq[:, :, -1] + twice * ddq[:, :, -1]], axis=-1),
        np.concatenate([ddq[:, :, 0], ddq[:, :, -1]], axis=-1),
        np.concatenate([acceleration, acceleration], axis=-1),
    )
    limit = (velocity / np.maximum(np.abs(dq[:, :, 0]), _SMALLEST_RATE)) ** 2
    one, other = np.triu_indices(a.shape[-1], 1)
    # Where the lower line of one meets the upper line of another.
    meet = _quotient(a[..., one] + a[..., other], np.abs(m[..., one] - m[..., other]))
    stop = _quotient(twice * a, twice * m - 1.0)  # x_{i+1} >= 0 stays possible
    bounds = [bound.min(axis=-1) for bound in (limit, meet, stop)]
    beta = np.zeros_like(s)
    beta[:, :-1] = np.min(bounds, axis=0)
    beta[rest] = 0.0

    # The passes go over intervals: these come first from here on. By each line x_{i+1}
    # is at most gain x_i + gift.
    gain, gift = np.moveaxis(1.0 - twice * m, 1, 0), np.moveaxis(twice * a, 1, 0)
    gain, gift = np.ascontiguousarray(gain), np.ascontiguousarray(gift)
    loss = _quotient(np.ones_like(gain), gain)
    beta = np.ascontiguousarray(beta.T)[..., None]
    least = partial(np.minimum.reduce, axis=-1, keepdims=True)
    for i in reversed(range(len(gain))):
        reach = least(loss[i] * (beta[i + 1] + gift[i]))
        beta[i] = np.minimum(beta[i], reach)

    x = np.zeros_like(beta)
    for i in range(len(gain)):
        reach = least(gain[i] * x[i] + gift[i])
        x[i + 1] = np.maximum(np.minimum(reach, beta[i + 1]), 0.0)
    return x[..., 0].T


def _lines(
    rate: np.ndarray, bend: np.ndarray, acceleration: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """a and m of |rate u + bend x| <= acceleration, written |u + m x| <= a."""
    size = np.maximum(np.abs(rate), _SMALLEST_RATE)
    return acceleration / size, np.where(rate < 0.0, -bend, bend) / size


def _quotient(bound: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """Largest x with slope * x <= bound, where slope > 0; infinite elsewhere."""
    return np.divide(bound, slope, out=np.full_like(slope, np.inf), where=slope > 0.0)


def _excess(
    s: np.ndarray,
    x: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> np.ndarray:
    """Factor `[P]` >= 1 by which x is too large somewhere within the intervals.

    A parabola rises above its five evenly spaced samples by at most 1/32 of what its
    middle is away from its chord, twice; an acceleration is one, a speed's square
    nearly.
    """
    step, rise = np.diff(s), np.diff(x)
    u = np.divide(rise, 2.0 * step, out=np.zeros_like(step), where=step > 0.0)
    x = (x[:, :-1, None] + rise[..., None] * _WITHIN)[..., None]
    speeds = dq**2 * x / velocity[:, None, None] ** 2
    accelerations = (ddq * x + dq * u[..., None, None]) / acceleration[:, None, None]
    used = np.concatenate([speeds, accelerations], axis=-1)
    between = np.abs(used[:, :, 0] - 2.0 * used[:, :, 2] + used[:, :, 4]) / 32.0
    most = (np.abs(used).max(axis=2) + between).max(axis=(1, 2))
    return np.maximum(most, 1.0)

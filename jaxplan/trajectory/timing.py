"""Time-optimal speed along a curve under velocity and acceleration limits (TOPP-RA).

Along q(s) let x = (ds/dt)^2 and u = d2s/dt2. On a grid of s both are linear constraints:

    0 <= x <= min_j (v_j / |q'_j|)^2,     |q'_j u + q''_j x| <= a_j,
    x_{i+1} = x_i + 2 (s_{i+1} - s_i) u_i.

A backward pass finds beta_i, the largest x_i from which rest can still be reached at the
end; a forward pass then takes the largest feasible u_i (Pham and Pham 2018). Each joint
bounds u by two parallel lines of slope -m_j = -q''_j / q'_j around 0, and all bounds of
x are where two such lines meet: so every linear program has a closed form, written here
for all problems at once. Accelerations bind at both ends of each interval (of constant
u), as 2 d lines; what they exceed in between is measured afterwards on a finer grid and
taken out by slowing the whole motion.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

_GRID = 128  # intervals of a curve's timing, at least
_SMALLEST_RATE = 1e-6  # stands for |dq_j/ds| of a joint that does not move
_END = 1.0 - 1e-6  # of an interval: a corner's derivatives are those behind it
_BETWEEN = np.array([0.0, 0.25, 0.5, 0.75, _END])  # where limits are measured


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

    x = _fastest(curves, s, rest, velocity[:, None], acceleration[:, None])
    speed = np.sqrt(x) / _excess(curves, s, x, velocity, acceleration)[:, None]
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
    """Grid of s and where the motion must rest on it, each `[N+1]`."""
    breaks = curve.t[curve.k : len(curve.t) - curve.k]
    spans = len(breaks) - 1
    # An even number of intervals: the middle of a straight line, where its speed peaks,
    # is then on the grid.
    per_span = 2 * int(max(np.ceil(_GRID / 2 / spans), 8 if curve.k == 1 else 1))
    share = np.arange(per_span) / per_span
    s = (breaks[:-1, None] + share * np.diff(breaks)[:, None]).ravel()
    s = np.append(s, breaks[-1])
    rest = np.zeros(len(s), bool)
    rest[:: per_span if curve.k == 1 else len(s) - 1] = True
    return s, rest


def _derivatives(
    curves: Sequence[BSpline], s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivative, `[P, n, d]`, at `s` `[P, n]`."""
    rows = list(zip(curves, s, strict=True))
    return np.stack([c(r, 1) for c, r in rows]), np.stack([c(r, 2) for c, r in rows])


def _fastest(
    curves: Sequence[BSpline],
    s: np.ndarray,
    rest: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> np.ndarray:
    """x `[P, N+1]` of the fastest motion: the two passes of TOPP-RA."""
    dq, ddq = _derivatives(curves, s)
    step = np.diff(s)[..., None]
    dq_end, ddq_end = _derivatives(curves, s[:, :-1] + _END * step[..., 0])
    # At an interval's end x has become x + 2 step u.
    a, m = _lines(
        np.concatenate([dq[:, :-1], dq_end + 2.0 * step * ddq_end], axis=-1),
        np.concatenate([ddq[:, :-1], ddq_end], axis=-1),
        np.concatenate([acceleration, acceleration], axis=-1),
    )

    beta = np.min((velocity / np.maximum(np.abs(dq), _SMALLEST_RATE)) ** 2, axis=-1)
    meet = m[..., None, :] - m[..., :, None]  # a lower line meets an upper one
    room = a[..., None, :] + a[..., :, None]
    fall = 2.0 * step * m - 1.0  # x_{i+1} >= 0 stays possible
    beta[:, :-1] = np.min(
        [
            beta[:, :-1],
            _quotient(room, meet).min(axis=(-2, -1)),
            _quotient(2.0 * step * a, fall).min(axis=-1),
        ],
        axis=0,
    )
    beta[rest] = 0.0
    for i in reversed(range(step.shape[1])):
        reach = beta[:, i + 1, None] + 2.0 * step[:, i] * a[:, i]
        beta[:, i] = np.minimum(beta[:, i], _quotient(reach, -fall[:, i]).min(axis=-1))

    x = np.zeros_like(beta)
    for i in range(step.shape[1]):
        u = np.min(a[:, i] - m[:, i] * x[:, i, None], axis=-1)
        x[:, i + 1] = np.clip(x[:, i] + 2.0 * step[:, i, 0] * u, 0.0, beta[:, i + 1])
    return x


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
    curves: Sequence[BSpline],
    s: np.ndarray,
    x: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
) -> np.ndarray:
    """Factor `[P]` >= 1 by which the motion must be slower to keep the limits."""
    step = np.diff(s)
    twice_u = np.diff(x)
    twice_u = np.divide(twice_u, step, out=np.zeros_like(step), where=step > 0.0)
    fine = s[:, :-1, None] + step[..., None] * _BETWEEN
    dq, ddq = _derivatives(curves, fine.reshape(len(s), -1))
    x_fine = (x[:, :-1, None] + np.diff(x)[..., None] * _BETWEEN).reshape(len(s), -1, 1)
    u_fine = np.repeat(twice_u / 2.0, len(_BETWEEN), axis=1)[..., None]
    speeds = np.abs(dq) * np.sqrt(x_fine) / velocity[:, None]
    accelerations = np.abs(ddq * x_fine + dq * u_fine) / acceleration[:, None]
    excess = np.maximum(
        speeds.max(axis=(1, 2)), np.sqrt(accelerations.max(axis=(1, 2)))
    )
    return np.maximum(excess, 1.0)

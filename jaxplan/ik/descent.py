"""Damped least squares towards a region of poses, from many configurations at once.

The batch is last, and every lane goes its own way: a step that comes nearer is taken and
the next is damped less, another is not taken and the next is damped more (Levenberg and
Marquardt).
"""

from collections.abc import Callable, Iterable
from functools import partial, reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision import World, per_scene
from jaxplan.collision.kinematics import frame_jacobian, in_float32, rotation_of
from jaxplan.ik.pose import Region
from jaxplan.scene import Scene

FLOAT = jnp.float32
"""Whatever the caller computes in."""
LANES = 256
"""Starts in a call: so few that XLA on CPU keeps to one core, and threads to theirs."""
ITERATIONS = 12
CANDIDATES = 16
"""Random configurations of which the nearest to the region is a start."""
LEVER = 0.3
"""What a turn of the body weighs [m/rad]."""
ACCURACY = (1e-3, 1e-3, 1e-3, 1.7e-3)
"""The last millimetre, or tenth of a degree, of every tolerance is the solver's: it aims at
the region without it, which is the middle where the tolerance is no wider."""
DAMPING, EASE, BRAKE, LEAST = 0.03, 0.2, 4.0, 1e-6
"""At first; its factors after a step that is taken and one that is not; at least."""


class Window(NamedTuple):
    """Where joints may be and where they start, `[d]` each [rad or m]."""

    low: Any
    high: Any
    first: Any
    """Starts are drawn from here"""
    last: Any
    """to here,"""
    reference: Any
    """around this."""


class Misfit(NamedTuple):
    """How far a body is outside of the region it aims at."""

    error: jax.Array
    """`[6, B]` position [m], and rotation times `LEVER`."""
    slope: jax.Array
    """`[6, d, B]` its derivative by the joints."""


@partial(per_scene, static_argnames="body")
def descend(
    scene: Scene,
    world: World,
    body: str,
    region: Region,
    window: Window,
    seed: jax.typing.ArrayLike,
    call: jax.typing.ArrayLike,
    spread: jax.typing.ArrayLike,
) -> tuple[jax.Array, jax.Array]:
    """Goes to a region from random configurations, within the joint limits.

    Args:
        scene: The scene.
        world: Without batch axes.
        body: Whose region it is.
        region: Of each lane, `[..., B]`.
        window: Of the joints.
        seed: Of the starts.
        call: Number of the call: each has starts of its own.
        spread: `[B]` 0 starts at the reference, 1 anywhere in the window.

    Returns:
        `[B, d]` joints, and `[B]` whether they bring the body into its region.
    """
    scene, world, region, window, spread = in_float32(
        (scene, world, region, window, spread)
    )
    world, window = jax.tree.map(lambda leaf: leaf[..., None], (world, window))
    accuracy = jnp.minimum(region.tolerance, jnp.array(ACCURACY, FLOAT)[:, None])

    def at(q: jax.Array) -> Misfit:
        # Walls, or XLA on CPU computes the arm again for every use.
        frame = jax.lax.optimization_barrier(frame_jacobian(scene, world, q, body))
        misfit = _misfit(region, region.tolerance - accuracy, *frame)
        return jax.lax.optimization_barrier(misfit)

    def within(misfit: Misfit, share: float) -> jax.Array:
        error = misfit.error
        angle = jnp.sqrt(_square(error[3:])) / LEVER
        size = jnp.concatenate([jnp.abs(error[:3]), angle[None]])
        return (size <= share * accuracy).all(0)

    def go(state: tuple) -> tuple:
        number, trial, q, misfit, damping, _ = state
        there = at(trial)
        nearer = _square(there.error) < _square(misfit.error)
        q = jnp.where(nearer, trial, q)
        misfit = jax.tree.map(partial(jnp.where, nearer), there, misfit)
        damping = damping * jnp.where(nearer, EASE, BRAKE)
        damping = jnp.maximum(damping, LEAST)
        trial = _step(q, misfit, damping, window)
        return number + 1, trial, q, misfit, damping, within(misfit, 0.1)

    key = jax.random.fold_in(jax.random.key(seed), call)
    q = _starts(key, at, window, jnp.asarray(spread))
    d, lanes = q.shape
    error, slope = jnp.full((6, lanes), jnp.inf, FLOAT), jnp.zeros((6, d, lanes), FLOAT)
    nowhere, damping = Misfit(error, slope), jnp.full(lanes, DAMPING / EASE, FLOAT)
    state = 0, q, q, nowhere, damping, jnp.zeros(lanes, bool)
    _, _, q, misfit, _, _ = jax.lax.while_loop(
        lambda state: (state[0] <= ITERATIONS) & ~state[-1].all(), go, state
    )
    return q.T, within(misfit, 0.5)


def _starts(
    key: jax.Array, at: Callable[[jax.Array], Misfit], window: Window, spread: jax.Array
) -> jax.Array:
    """`[d, B]` for each lane the nearest of some configurations."""
    shape = CANDIDATES, len(window.low), len(spread)
    drawn = jax.random.uniform(key, shape, FLOAT, window.first, window.last)
    drawn = window.reference + spread * (drawn - window.reference)

    def nearer(best: tuple, q: jax.Array) -> tuple:
        distance = _square(at(q).error)
        keep = best[0] <= distance
        return (jnp.where(keep, best[0], distance), jnp.where(keep, best[1], q)), None

    best = jnp.full(len(spread), jnp.inf, FLOAT), drawn[0]
    return jax.lax.scan(nearer, best, jnp.asarray(drawn))[0][1]


def _step(
    q: jax.Array, misfit: Misfit, damping: jax.Array, window: Window
) -> jax.Array:
    """`[d, B]` where a damped step leads; joints that would leave their limits stop there.

    Those that a first step pushes out of their limits take no part in the second, so that
    the others make up for them.
    """
    error, slope = misfit
    step = jnp.zeros_like(q)
    locked = jnp.zeros(q.shape, bool)
    for _ in range(2):
        slope = jnp.where(locked, 0, slope)
        square = _sum(slope[:, None, j] * slope[None, :, j] for j in range(len(q)))
        square = square + damping * jnp.eye(6, dtype=FLOAT)[..., None]
        force = _solve(jax.lax.optimization_barrier(square), error)
        step = -_sum(slope[i] * force[i] for i in range(6))
        out = (q + step < window.low) | (q + step > window.high)
        locked |= out
    return jnp.clip(q + step, window.low, window.high)


def _misfit(
    region: Region, slack: jax.Array, pose: jax.Array, jacobian: jax.Array
) -> Misfit:
    """How far the body is outside of the region's inside.

    Args:
        region: `[..., B]`.
        slack: `[4, B]` of the three coordinates [m] and of the angle [rad].
        pose: `[3, 4, B]` of the body.
        jacobian: `[6, d, B]` of the body.
    """
    turn, spin = pose[:, :3], jacobian[3:]
    arm = _turned(turn, region.offset)
    linear = jacobian[:3] + jnp.cross(spin, arm[:, None], axis=0)
    away = pose[:, 3] + arm - region.position
    outside = jnp.abs(away) > slack[:3]
    away = away - jnp.clip(away, -slack[:3], slack[:3])
    linear = jnp.where(outside[:, None], linear, 0)

    sine, cosine, kept = _turn(turn, rotation_of(region.quaternion), region.axis)
    length = jnp.sqrt(_square(sine))
    axis = sine / jnp.maximum(length, 1e-12)
    angle = jnp.arctan2(length, cosine)
    excess = jnp.maximum(angle - slack[3], 0)
    spin = spin - kept[:, None] * _dot(kept[:, None], spin)
    # A turn about the error's own axis counts in full, others by the excess's share.
    share = excess / jnp.maximum(angle, 1e-12)
    spin = share * spin + (1 - share) * axis[:, None] * _dot(axis[:, None], spin)
    spin = jnp.where((excess > 0)[None, None], spin, 0)
    return Misfit(
        jnp.concatenate([away, LEVER * excess * axis]),
        jnp.concatenate([linear, LEVER * spin]),
    )


def _turn(
    turn: jax.Array, wanted: jax.Array, axis: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The rotation from the wanted orientation to the body's.

    Where it may turn about an axis, the shortest one that turns that axis.

    Returns:
        Its axis times its sine `[3, B]` in the world, its cosine `[B]`, and the axis about
        which turning is free `[3, B]`, or zeros.
    """
    now, then = _turned(turn, axis), _turned(wanted, axis)
    r = _sum(turn[:, None, k] * wanted[None, :, k] for k in range(3))
    whole = jnp.stack([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / 2
    free = (axis != 0).any(0)
    sine = jnp.where(free, jnp.cross(then, now, axis=0), whole)
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    return sine, jnp.where(free, _dot(then, now), (trace - 1) / 2), then


def _solve(matrix: jax.Array, right: jax.Array) -> jax.Array:
    """`[n, B]` solutions of `[n, n, B]`, positive definite: elimination in all lanes."""
    rows = jnp.concatenate([matrix, right[:, None]], 1)
    for k in range(len(rows)):
        pivot = rows[k] / rows[k, k]
        rows = (rows - rows[:, k, None] * pivot).at[k].set(pivot)
    return rows[:, -1]


# Sums written out: XLA on CPU is slow to reduce over leading axes.
def _dot(a: jax.Array, b: jax.Array) -> jax.Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _square(a: jax.Array) -> jax.Array:
    return _sum(row * row for row in a)


def _sum(terms: Iterable[jax.Array]) -> jax.Array:
    return reduce(jnp.add, terms)


def _turned(rotation: jax.Array, vector: jax.Array) -> jax.Array:
    """`[3, B]`."""
    return (
        rotation[:, 0] * vector[0]
        + rotation[:, 1] * vector[1]
        + rotation[:, 2] * vector[2]
    )

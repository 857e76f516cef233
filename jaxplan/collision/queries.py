"""The questions that planning asks: how far, free or not, free along a motion."""

import math
from typing import Literal

import jax
import jax.numpy as jnp

from jaxplan.collision.checks import checked
from jaxplan.collision.engine import least_scores
from jaxplan.collision.mjx_backend import least_distances
from jaxplan.collision.narrow import Score
from jaxplan.collision.world import OWN_AXES, World, batch_shape
from jaxplan.process import refuse_fork
from jaxplan.ranges import Count, NotNegative, Positive, check, numbers
from jaxplan.scene import Scene

Backend = Literal["fast", "mjx"]
"""`fast`: our narrow phase. `mjx`: `mjx.collision`, slow, for reference. Its distance
between a convex geom and what does not touch it may be too large, so that of its answers
only those about contact itself (margin 0) and the depth of penetration are to be relied on."""


def clearance(
    scene: Scene, world: World, q: jax.Array, backend: Backend = "fast"
) -> jax.Array:
    """Least signed distance over all pairs that count.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        backend: Who answers.

    Returns:
        `[...]` [m], negative = penetration; NaN where q or the world is not finite, or a
        quaternion is zero.
    """
    world, q = checked(scene, world, q=q)
    return _flat(scene, world, q, Score(exact=True), backend)


def config_free(
    scene: Scene,
    world: World,
    q: jax.Array,
    margin: jax.typing.ArrayLike = 0.0,
    backend: Backend = "fast",
) -> jax.Array:
    """Whether clearance > margin; False where something is not finite.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        margin: [m], at least 0.
        backend: Who answers.

    Returns:
        `[...]` bool.
    """
    world, q = checked(scene, world, q=q)
    if not isinstance(margin, jax.Array):
        margin = numbers("margin", margin)
    exact = backend == "mjx"
    return _flat(scene, world, q, Score(exact, jnp.asarray(margin)), backend) > 0


def motion_free(
    scene: Scene,
    world: World,
    q0: jax.Array,
    q1: jax.Array,
    points: int,
    margin: jax.typing.ArrayLike = 0.0,
    backend: Backend = "fast",
) -> jax.Array:
    """Whether the straight motion from q0 to q1 is free.

    Checks `points` configurations, evenly spaced, q1 among them and q0 not: it was
    checked when it became a node. `points_for` says how many a step length needs.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q0 and q1.
        q0: `[..., d]` start [rad].
        q1: `[..., d]` end [rad].
        points: Checked configurations per motion.
        margin: [m], at least 0.
        backend: Who answers.

    Returns:
        `[...]` bool.
    """
    world, q0, q1 = checked(scene, world, q0=q0, q1=q1)
    check("points", points, Count)
    share = (jnp.arange(points) + 1) / points
    q0, q1 = q0[..., None, :], q1[..., None, :]
    q = q0 + share[:, None] * (q1 - q0)
    leaves = zip(world, OWN_AXES, strict=True)
    along = World(*(jnp.expand_dims(leaf, -1 - own) for leaf, own in leaves))
    return jnp.all(config_free(scene, along, q, margin, backend), -1)


def points_for(length: float, resolution: float) -> int:
    """Configurations to check so that none of their gaps exceeds `resolution` [rad]."""
    check("length", length, NotNegative)
    check("resolution", resolution, Positive)
    return max(1, math.ceil(length / resolution - 1e-9))


def _flat(
    scene: Scene, world: World, q: jax.Array, score: Score, backend: Backend
) -> jax.Array:
    """Flattens the batch, moves it to the last axis, and asks the backend."""
    refuse_fork()
    check("backend", backend, Backend)
    shape = batch_shape(world, q)
    finite = jnp.isfinite(q).all(-1)
    for pose in (world.object_pose, world.slot_pose):
        finite &= jnp.isfinite(pose).all((-2, -1))
        finite &= (pose[..., 3:] != 0).any(-1).all(-1)  # a rotation
    finite &= jnp.isfinite(world.passive).all(-1)
    finite &= jnp.isfinite(world.slot_size).all((-2, -1))
    leaves = zip(world, OWN_AXES, strict=True)
    flat = World(*(_batch_last(leaf, shape, own) for leaf, own in leaves))
    rows = _batch_last(jnp.broadcast_to(q, (*shape, q.shape[-1])), shape, 1)
    if backend == "fast":
        scores = least_scores(scene, flat, rows, score)
    else:
        scores = least_distances(scene, flat, rows) - score.margin
    return jnp.where(finite, scores.reshape(shape), jnp.nan)


def _batch_last(leaf: jax.Array, shape: tuple[int, ...], own: int) -> jax.Array:
    """`[..., *own]` to `[*own, N]`, or to `[*own, 1]` if the whole batch shares it."""
    tail = leaf.shape[leaf.ndim - own :]
    if math.prod(leaf.shape[: leaf.ndim - own]) == 1:
        return leaf.reshape(*tail, 1)
    rows = jnp.broadcast_to(leaf, (*shape, *tail)).reshape(math.prod(shape), *tail)
    return jnp.moveaxis(rows, 0, -1)

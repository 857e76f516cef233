"""The questions that planning asks: how far, free or not, free along a motion."""

import math
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from jaxplan.collision.bounds import group_bounds, pair_reaches
from jaxplan.collision.checks import checked
from jaxplan.collision.engine import least_scores
from jaxplan.collision.margins import required_clearances
from jaxplan.collision.mjx_backend import least_distances
from jaxplan.collision.narrow import Score
from jaxplan.collision.world import OWN_AXES, World, batch_shape
from jaxplan.process import refuse_fork
from jaxplan.ranges import Count, check, numbers
from jaxplan.scene import Scene

Backend = Literal["fast", "mjx"]
"""`fast`: our narrow phase. `mjx`: `mjx.collision`, slow, for reference. Its distance
between a convex geom and what does not touch it may be too large, so that of its answers
only those about contact itself (margin 0) and the depth of penetration are to be relied on."""


def clearance(
    scene: Scene,
    world: World,
    q: jax.Array,
    backend: Backend = "fast",
    motion: jax.Array | None = None,
) -> jax.Array:
    """Least signed distance over all pairs that count.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        backend: Who answers.
        motion: `[..., d]` [rad or m]. If given: a lower bound on it in every configuration
            whose joints are each within `motion` of q, but for rounding in float32.

    Returns:
        `[...]` [m], negative = penetration; NaN where q or the world is not finite, or a
        quaternion is zero.
    """
    world, q = checked(scene, world, q=q)
    return _flat(scene, world, q, None, backend, motion)


def config_free(
    scene: Scene,
    world: World,
    q: jax.Array,
    margin: jax.typing.ArrayLike = 0.0,
    backend: Backend = "fast",
    motion: jax.Array | None = None,
) -> jax.Array:
    """Whether clearance > margin; False where something is not finite.

    Of each pair the margin is the greater of this one and the model's own, the sum of its
    geoms' or that of an explicit pair (`required_clearances`).

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        margin: [m], at least 0.
        backend: Who answers.
        motion: `[..., d]` [rad or m]. If given: whether that is proven, but for rounding in
            float32, of every configuration whose joints are each within `motion` of q.

    Returns:
        `[...]` bool.
    """
    world, q = checked(scene, world, q=q)
    if not isinstance(margin, jax.Array):
        margin = numbers("margin", margin)
    return _flat(scene, world, q, _single(margin), backend, motion) > 0


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
    checked when it became a node. `planning.points_for` says how many a length needs.

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


def motion_bound(
    scene: Scene,
    world: World,
    dq: jax.Array,
    q_min: jax.Array | None = None,
    q_max: jax.Array | None = None,
) -> jax.Array:
    """How far a straight joint motion moves any two geoms that count, one against the other.

    Never too small, wherever within the limits the motion begins.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of dq.
        dq: `[..., d]` from the start of the motion to its end [rad or m].
        q_min: `[d]` lower limits [rad or m]; the scene's where None, which is for concrete
            scenes where joints depend on others (`Scene.q_min`).
        q_max: `[d]` upper limits.

    Returns:
        `[...]` [m]; infinite where a hinge turns that has a slide without limits above it on
        the way to a geom, NaN where something is not finite.
    """
    low = scene.q_min if q_min is None else q_min
    high = scene.q_max if q_max is None else q_max
    scene, world, dq, low, high = jax.tree.map(_single, (scene, world, dq, low, high))
    shape, finite, flat, (rows,) = _flatten(world, dq)
    if not scene.groups:
        return jnp.where(finite, 0.0, jnp.nan)
    bound = jnp.max(group_bounds(scene, flat, rows, (low, high)), 0)
    return jnp.where(
        finite, jnp.broadcast_to(bound, rows.shape[-1:]).reshape(shape), jnp.nan
    )


def pair_motion_bounds(scene: Scene, world: World, dq: npt.ArrayLike) -> np.ndarray:
    """How far joint motions move the geoms of each pair, one against the other.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        dq: `[..., d]` how far each joint moves [rad or m].

    Returns:
        `[..., ngeom, ngeom]` [m], symmetric, by geom id: at most this, wherever within the
        scene's limits the arm is; 0 of pairs that are not checked.
    """
    scene, world = jax.tree.map(_single, (scene, world))
    table = pair_reaches(scene, World(*(leaf[..., None] for leaf in world)))
    moved = np.abs(np.asarray(dq, float))[..., None, None, :]
    return np.where(moved == 0, 0, moved * table).sum(-1)


def _flat(
    scene: Scene,
    world: World,
    q: jax.Array,
    margin: jax.Array | None,
    backend: Backend,
    motion: jax.Array | None = None,
) -> jax.Array:
    """Asks the backend about the flattened batch; without a margin, for distances."""
    refuse_fork()
    check("backend", backend, Backend)
    scene, world, q, motion = jax.tree.map(_single, (scene, world, q, motion))
    given = [q] if motion is None else [q, motion]
    shape, finite, flat, rows = _flatten(world, *given)
    if backend == "fast":
        score = Score(exact=True) if margin is None else Score(False, margin)
        scores = least_scores(scene, flat, rows[0], score, *rows[1:])
    else:
        table = None if margin is None else required_clearances(scene, margin)
        scores = least_distances(scene, flat, rows[0], table)
        if motion is not None and scene.groups:
            scores -= jnp.max(group_bounds(scene, flat, rows[1]), 0)
    return jnp.where(finite, scores.reshape(shape), jnp.nan)


def _flatten(
    world: World, *given: jax.Array
) -> tuple[tuple[int, ...], jax.Array, World, list[jax.Array]]:
    """The batch's shape, where all is finite, and world and vectors with the batch last."""
    shape = jnp.broadcast_shapes(*(batch_shape(world, x) for x in given))
    finite = jnp.ones((), bool)
    for vectors in given:
        finite &= jnp.isfinite(vectors).all(-1)
    for pose in (world.object_pose, world.slot_pose):
        finite &= jnp.isfinite(pose).all((-2, -1))
        finite &= (pose[..., 3:] != 0).any(-1).all(-1)  # a rotation
    finite &= jnp.isfinite(world.passive).all(-1)
    for rows in (world.slot_size, world.geom_pos, world.geom_size):
        finite &= jnp.isfinite(rows).all((-2, -1))
    leaves = zip(world, OWN_AXES, strict=True)
    flat = World(*(_batch_last(leaf, shape, own) for leaf, own in leaves))
    rows = [
        _batch_last(jnp.broadcast_to(x, (*shape, x.shape[-1])), shape, 1) for x in given
    ]
    return shape, finite, flat, rows


def _single(leaf: jax.typing.ArrayLike) -> jax.Array:
    """In float32, whatever the caller computes in; flags stay flags."""
    leaf = jnp.asarray(leaf)
    return leaf if leaf.dtype == bool else leaf.astype(jnp.float32)


def _batch_last(leaf: jax.Array, shape: tuple[int, ...], own: int) -> jax.Array:
    """`[..., *own]` to `[*own, N]`, or to `[*own, 1]` if the whole batch shares it."""
    tail = leaf.shape[leaf.ndim - own :]
    if math.prod(leaf.shape[: leaf.ndim - own]) == 1:
        return leaf.reshape(*tail, 1)
    rows = jnp.broadcast_to(leaf, (*shape, *tail)).reshape(math.prod(shape), *tail)
    return jnp.moveaxis(rows, 0, -1)

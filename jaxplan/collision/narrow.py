"""Signed distances between kinds of geoms, batch last, one plain expression per obstacle.

Geoms that face the same obstacles are one array, `[3, n, B]`; the obstacles are a
Python loop over a running minimum. XLA turns this into one vectorised pass over the
cache; boolean reductions, or obstacles as an axis, are ten times slower.
"""

from collections.abc import Callable, Iterable
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.kinematics import Pose, rotation_of, turn, turn_back
from jaxplan.scene import Geoms, Scene


class Score(NamedTuple):
    """How a distance is rated."""

    exact: bool
    """True: signed distance [m]. False: only the sign of distance - margin counts,
    which spares the square root and what happens inside a box."""
    margin: jax.Array | float = 0.0
    """[m], at least 0; subtracted."""

    def of_squared(self, squared: jax.Array, radius: jax.Array) -> jax.Array:
        """Rates a squared distance between cores that are `radius` thick together."""
        reach = radius + self.margin
        if self.exact:
            return jnp.sqrt(squared) - reach
        return squared - reach * reach

    def of(self, distance: jax.Array, radius: jax.Array | float) -> jax.Array:
        """Rates a signed distance to a core that is `radius` thick."""
        return distance - (radius + self.margin)


class Shapes(NamedTuple):
    """Geoms of one kind: in the frame of their body (B = 1) or in the world."""

    centre: jax.Array
    """`[3, n, B]` [m]"""
    rotation: jax.Array
    """`[3, 3, n, B]`"""
    size: jax.Array
    """`[3, n, 1]` MuJoCo's sizes [m]"""


def read(scene: Scene, geoms: Geoms) -> Shapes:
    """Geoms in the frame of their body."""
    ids, model = np.array(geoms.ids), scene.model
    rotation = rotation_of(model.geom_quat[ids].T)[..., None]
    return Shapes(
        model.geom_pos[ids].T[..., None], rotation, model.geom_size[ids].T[..., None]
    )


def place(shapes: Shapes, pose: Pose) -> Shapes:
    """Geoms of a body in the world."""
    centre = turn(pose.rotation, shapes.centre) + pose.position[:, None]
    columns = [turn(pose.rotation, shapes.rotation[:, j]) for j in range(3)]
    return Shapes(centre, jnp.stack(columns, 1), shapes.size)


def place_back(shapes: Shapes, pose: Pose) -> Shapes:
    """Geoms of the world in the frame of a body."""
    centre = turn_back(pose.rotation, shapes.centre - pose.position[:, None])
    columns = [turn_back(pose.rotation, shapes.rotation[:, j]) for j in range(3)]
    return Shapes(centre, jnp.stack(columns, 1), shapes.size)


def join(parts: list[Shapes]) -> Shapes:
    """Geoms of several bodies as one array."""
    width = max(part.centre.shape[-1] for part in parts)

    def along(leaves: Iterable[jax.Array], width: int) -> jax.Array:
        wide = [jnp.broadcast_to(x, (*x.shape[:-1], width)) for x in leaves]
        return jnp.concatenate(wide, -2)

    centres, rotations, sizes = zip(*parts, strict=True)
    return Shapes(along(centres, width), along(rotations, width), along(sizes, 1))


def _dot(a: jax.Array, b: jax.Array) -> jax.Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _least(scores: Iterable[jax.Array]) -> jax.Array:
    return reduce(jnp.minimum, scores)


def _columns(b: Shapes) -> Iterable[Shapes]:
    """The obstacles one by one, n = 1."""
    for j in range(b.size.shape[1]):
        yield Shapes(
            b.centre[:, j, None], b.rotation[:, :, j, None], b.size[:, j, None]
        )


def sphere_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height above the planes."""
    heights = (_dot(a.centre - o.centre, o.rotation[:, 2]) for o in _columns(b))
    return score.of(_least(heights), a.size[0])


def capsule_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height of the lower end."""
    heights = (
        _dot(a.centre - o.centre, o.rotation[:, 2])
        - jnp.abs(_dot(a.rotation[:, 2], o.rotation[:, 2])) * a.size[1]
        for o in _columns(b)
    )
    return score.of(_least(heights), a.size[0])


def box_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height of the lowest corner."""
    heights = (
        _dot(a.centre - o.centre, o.rotation[:, 2])
        - sum(
            jnp.abs(_dot(a.rotation[:, k], o.rotation[:, 2])) * a.size[k]
            for k in range(3)
        )
        for o in _columns(b)
    )
    return score.of(_least(heights), 0.0)


def sphere_sphere(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of centres."""

    def one(o: Shapes) -> jax.Array:
        offset = a.centre - o.centre
        return score.of_squared(_dot(offset, offset), a.size[0] + o.size[0])

    return _least(one(o) for o in _columns(b))


def sphere_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to the nearest point of the capsule's line."""

    def one(o: Shapes) -> jax.Array:
        axis, offset = o.rotation[:, 2], a.centre - o.centre
        along = jnp.clip(_dot(offset, axis), -o.size[1], o.size[1])
        offset = offset - along * axis
        return score.of_squared(_dot(offset, offset), a.size[0] + o.size[0])

    return _least(one(o) for o in _columns(b))


def capsule_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of segments (Ericson, Real-Time Collision Detection, 5.1.9)."""

    def one(o: Shapes) -> jax.Array:
        axis_a, axis_b, offset = a.rotation[:, 2], o.rotation[:, 2], a.centre - o.centre
        across = _dot(axis_a, axis_b)
        along_a, along_b = _dot(axis_a, offset), _dot(axis_b, offset)
        # Of parallel lines any point will do; the clamps below find its partner.
        s = (across * along_b - along_a) / jnp.maximum(1 - across * across, 1e-9)
        s = jnp.clip(s, -a.size[1], a.size[1])
        t = jnp.clip(along_b + s * across, -o.size[1], o.size[1])
        s = jnp.clip(t * across - along_a, -a.size[1], a.size[1])
        gap = offset + s * axis_a - t * axis_b
        return score.of_squared(_dot(gap, gap), a.size[0] + o.size[0])

    return _least(one(o) for o in _columns(b))


def sphere_box(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to boxes; `a` and `b` in the frame of the boxes' body.

    The boxes' axes agree up to order and sign, so one turn of the points serves all.
    """
    frame = b.rotation[:, :, 0]
    points = turn_back(frame, a.centre)
    middles = turn_back(frame, b.centre)
    # Turning one such box into another only permutes its half sizes.
    columns = [turn_back(frame, b.rotation[:, k]) for k in range(3)]
    halves = sum(jnp.abs(columns[k]) * b.size[k] for k in range(3))

    def one(j: int) -> jax.Array:
        over = jnp.abs(points - middles[:, j, None]) - halves[:, j, None]
        beyond = jnp.maximum(over, 0)
        rated = score.of_squared(_dot(beyond, beyond), a.size[0])
        if score.exact:
            deepest = jnp.maximum(jnp.maximum(over[0], over[1]), over[2])
            rated += jnp.minimum(deepest, 0)
        return rated

    return _least(one(j) for j in range(b.size.shape[1]))


FUNCTIONS: dict[tuple[str, str], Callable[[Shapes, Shapes, Score], jax.Array]] = {
    ("sphere", "sphere"): sphere_sphere,
    ("sphere", "capsule"): sphere_capsule,
    ("sphere", "box"): sphere_box,
    ("sphere", "plane"): sphere_plane,
    ("capsule", "capsule"): capsule_capsule,
    ("capsule", "plane"): capsule_plane,
    ("box", "plane"): box_plane,
}
"""Least score of each geom of a over the obstacles b, `[n, B]`, by kinds. Pairs of kinds
that are not here are left to `mjx.collision`."""

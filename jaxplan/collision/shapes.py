"""Geoms as the narrow phase sees them: batch last, each coordinate an array of its own.

Geoms of one kind are rows of one array, `[n, B]` for each coordinate. They are read in
the frames of their bodies, where they are constants, and carried to where they are.
"""

from collections.abc import Iterable
from functools import partial, reduce
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.collision.hulls import Hulls, read_hulls
from jaxplan.collision.kinematics import rotation_of
from jaxplan.collision.world import World
from jaxplan.scene import Scene

Vector = list[jax.Array]
"""Three coordinates, each an array of its own."""

Values = TypeVar("Values")


class Score(NamedTuple):
    """How a distance is rated."""

    exact: bool
    """True: signed distance [m]. False: only the sign of distance - margin counts,
    which spares the square root and what happens inside a box."""
    margin: Any = 0.0
    """[m], at least 0; subtracted. A number or `[n, B]`; in closed form one for each of the
    obstacles that the geoms face, in a list."""

    def among(self, first: int, count: int) -> "Score":
        """For some of the obstacles."""
        if not isinstance(self.margin, list):
            return self
        return self._replace(margin=self.margin[first : first + count])

    def against(self, obstacle: int) -> "Score":
        """For one of the obstacles."""
        if not isinstance(self.margin, list):
            return self
        return self._replace(margin=self.margin[obstacle])

    def of_squared(self, squared: jax.Array, radius: jax.Array | float) -> jax.Array:
        """Rates a squared distance between cores that are `radius` thick together."""
        reach = radius + self.margin
        if self.exact:
            return jnp.sqrt(squared) - reach
        return squared - reach * reach

    def of(self, distance: jax.Array, radius: jax.Array | float) -> jax.Array:
        """Rates a signed distance to a core that is `radius` thick."""
        return distance - (radius + self.margin)


class Shapes(NamedTuple):
    """Geoms of one kind, in some frame."""

    centre: Vector
    """Each `[n, B]` [m]; B = 1 in the frame of their own body."""
    axes: list[Vector]
    """The geoms' x, y and z in that frame."""
    size: Vector
    """MuJoCo's sizes, each `[n, B]` or `[n, 1]` [m]."""
    hulls: Hulls | None = None
    """Of meshes."""


def read(scene: Scene, ids: tuple[int, ...], world: World | None = None) -> Shapes:
    """Geoms in the frames of their bodies.

    Args:
        scene: The scene.
        ids: Of the geoms.
        world: Leaves with the batch last; without it, shaped geoms are the model's.
    """
    model, rows = scene.model, np.array(ids)
    rotation = rotation_of(model.geom_quat[rows].T)[..., None]
    mesh = scene.mj_model.geom_type[ids[0]] == mujoco.mjtGeom.mjGEOM_MESH
    shapes = Shapes(
        list(model.geom_pos[rows].T[..., None]),
        [list(rotation[:, k]) for k in range(3)],
        list(model.geom_size[rows].T[..., None]),
        read_hulls(scene.mj_model, ids) if mesh else None,
    )
    own = {geom: row for row, geom in enumerate(scene.shaped)}
    if world is None or not own.keys() & set(ids):
        return shapes
    # Of both, the model's and the world's, one gather takes each geom's.
    order = np.array([own.get(g, len(own) + i) for i, g in enumerate(ids)])

    def chosen(fixed: jax.Array, given: jax.Array) -> jax.Array:
        wide = jnp.broadcast_to(fixed, (len(ids), given.shape[-1]))
        return jnp.concatenate([given, wide])[order]

    pos, size = (jnp.moveaxis(leaf, 1, 0) for leaf in (world.geom_pos, world.geom_size))
    return shapes._replace(
        centre=[*map(chosen, shapes.centre, pos)],
        size=[*map(chosen, shapes.size, size)],
    )


def in_world(shapes: Shapes, poses: jax.Array, rows: np.ndarray) -> Shapes:
    """Geoms in the world.

    Args:
        shapes: Geoms in the frames of their bodies.
        poses: `[n_links, 3, 4, B]` poses in the world.
        rows: `[n]` the link of each geom.
    """
    # One gather: XLA vectorises what reads one array, not what reads twelve.
    pose = poses[rows]

    def turn(vector: Vector) -> Vector:
        return [total(pose[:, i, k] * vector[k] for k in range(3)) for i in range(3)]

    centre = [x + pose[:, i, 3] for i, x in enumerate(turn(shapes.centre))]
    return shapes._replace(centre=centre, axes=[turn(axis) for axis in shapes.axes])


def seen_from(shapes: Shapes, frame: jax.Array) -> Shapes:
    """Geoms of the world in the frame `[3, 4, B]`."""

    def turn_back(vector: Vector) -> Vector:
        return [total(frame[k, i] * vector[k] for k in range(3)) for i in range(3)]

    offset = [shapes.centre[i] - frame[i, 3] for i in range(3)]
    return shapes._replace(
        centre=turn_back(offset), axes=[turn_back(axis) for axis in shapes.axes]
    )


def smaller(a: jax.Array, b: jax.Array | float) -> jax.Array:
    """Minimum in one instruction, where `jnp.minimum` takes three to keep NaN.

    NaN is looked for in what comes in (`queries`).
    """
    return jnp.where(a < b, a, b)


def larger(a: jax.Array, b: jax.Array | float) -> jax.Array:
    """Maximum in one instruction, see `smaller`."""
    return jnp.where(a > b, a, b)


def total(terms: Iterable[jax.Array]) -> jax.Array:
    """Sum."""
    return reduce(jnp.add, terms)


def dot(a: Vector, b: Vector) -> jax.Array:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def plus(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return [x + y for x, y in zip(a, b, strict=True)]


def minus(a: Vector, b: Vector) -> Vector:
    """a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def times(factor: jax.Array, a: Vector) -> Vector:
    """The vector a, scaled."""
    return [factor * x for x in a]


def where(choose: jax.Array, a: Vector, b: Vector) -> Vector:
    """The vector a where chosen, else b."""
    return [jnp.where(choose, x, y) for x, y in zip(a, b, strict=True)]


def once(values: Values) -> Values:
    """Some arrays of floats, made sure to be computed once.

    XLA on CPU computes what several results share again for each of them, rounded in
    another way, and looks past any `optimization_barrier`. Where a comparison decides,
    results then need not belong together. It does not look through a condition.
    """
    if jax.default_backend() != "cpu":
        return jax.lax.optimization_barrier(values)
    # No leaf is a constant alone, of which XLA would see that the condition holds; nothing
    # that is computed has these bits.
    first = sum(leaf.reshape(-1)[0] for leaf in jax.tree.leaves(values))
    always = jax.lax.bitcast_convert_type(first, jnp.int32) != 0x7FC0BEEF
    zeros = partial(jax.tree.map, jnp.zeros_like, values)
    return jax.lax.cond(always, lambda: values, zeros)

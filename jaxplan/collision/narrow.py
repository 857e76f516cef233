"""Signed distances between kinds of geoms, batch last, one plain expression per obstacle.

Geoms that face the same obstacles are rows of one array, `[n, B]` for each coordinate,
in the frame of the obstacles' body, where the obstacles are constants; these are a
Python loop over a running minimum. XLA turns it into one vectorised pass over the
cache; boolean reductions, or obstacles as an axis, are ten times slower.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.kinematics import rotation_of
from jaxplan.scene import Scene


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


Vector = list[jax.Array]
"""Three coordinates, each an array of its own."""


class Shapes(NamedTuple):
    """Geoms of one kind, in some frame."""

    centre: Vector
    """Each `[n, B]` [m]; B = 1 in the frame of their own body."""
    axes: list[Vector]
    """The geoms' x, y and z in that frame."""
    size: Vector
    """MuJoCo's sizes, each `[n, 1]` [m]."""

    def __len__(self) -> int:
        return self.size[0].shape[0]


def read(scene: Scene, ids: tuple[int, ...]) -> Shapes:
    """Geoms in the frames of their bodies."""
    model, rows = scene.model, np.array(ids)
    rotation = rotation_of(model.geom_quat[rows].T)[..., None]
    return Shapes(
        list(model.geom_pos[rows].T[..., None]),
        [list(rotation[:, k]) for k in range(3)],
        list(model.geom_size[rows].T[..., None]),
    )


def relative(
    shapes: Shapes, poses: jax.Array, rows: np.ndarray, frame: jax.Array
) -> Shapes:
    """Geoms in another frame than that of their bodies.

    Args:
        shapes: Geoms in the frames of their bodies.
        poses: `[n_links, 3, 4, B]` poses in the world.
        rows: `[n]` the link of each geom.
        frame: `[3, 4, B]` the other frame.
    """

    def turn(vector: Vector) -> Vector:
        return [_sum(pose[:, i, k] * vector[k] for k in range(3)) for i in range(3)]

    def turn_back(vector: Vector) -> Vector:
        return [_sum(frame[k, i] * vector[k] for k in range(3)) for i in range(3)]

    # One gather: XLA vectorises what reads one array, not what reads twelve.
    pose = poses[rows]
    moved = turn(shapes.centre)
    offset = [moved[i] + pose[:, i, 3] - frame[i, 3] for i in range(3)]
    axes = [turn_back(turn(axis)) for axis in shapes.axes]
    return Shapes(turn_back(offset), axes, shapes.size)


def smaller(a: jax.Array, b: jax.Array | float) -> jax.Array:
    """Minimum in one instruction, where `jnp.minimum` takes three to keep NaN.

    NaN is looked for in what comes in (`queries`).
    """
    return jnp.where(a < b, a, b)


def larger(a: jax.Array, b: jax.Array | float) -> jax.Array:
    """Maximum in one instruction, see `smaller`."""
    return jnp.where(a > b, a, b)


def _sum(terms: Iterable[jax.Array]) -> jax.Array:
    return reduce(jnp.add, terms)


def _dot(a: Vector, b: Vector) -> jax.Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _minus(a: Vector, b: Vector) -> Vector:
    return [x - y for x, y in zip(a, b, strict=True)]


def _times(factor: jax.Array, a: Vector) -> Vector:
    return [factor * x for x in a]


def _clip(x: jax.Array, bound: jax.Array) -> jax.Array:
    return smaller(larger(x, -bound), bound)


def _least(scores: Iterable[jax.Array]) -> jax.Array:
    return reduce(smaller, scores)


def _each(b: Shapes) -> Iterator[Shapes]:
    """The obstacles one by one, as scalars."""
    for j in range(len(b)):
        yield Shapes(*jax.tree.map(lambda leaf: leaf[j, 0], tuple(b)))  # noqa: B023


def sphere_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height above the planes."""
    heights = (_dot(_minus(a.centre, o.centre), o.axes[2]) for o in _each(b))
    return score.of(_least(heights), a.size[0])


def capsule_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height of the lower end."""
    heights = (
        _dot(_minus(a.centre, o.centre), o.axes[2])
        - jnp.abs(_dot(a.axes[2], o.axes[2])) * a.size[1]
        for o in _each(b)
    )
    return score.of(_least(heights), a.size[0])


def box_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height of the lowest corner."""
    heights = (
        _dot(_minus(a.centre, o.centre), o.axes[2])
        - sum(jnp.abs(_dot(a.axes[k], o.axes[2])) * a.size[k] for k in range(3))
        for o in _each(b)
    )
    return score.of(_least(heights), 0.0)


def sphere_sphere(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of centres."""

    def one(o: Shapes) -> jax.Array:
        offset = _minus(a.centre, o.centre)
        return score.of_squared(_dot(offset, offset), a.size[0] + o.size[0])

    return _least(map(one, _each(b)))


def sphere_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to the nearest point of the capsule's line."""

    def one(o: Shapes) -> jax.Array:
        offset = _minus(a.centre, o.centre)
        along = _clip(_dot(offset, o.axes[2]), o.size[1])
        offset = _minus(offset, _times(along, o.axes[2]))
        return score.of_squared(_dot(offset, offset), a.size[0] + o.size[0])

    return _least(map(one, _each(b)))


def capsule_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of segments (Ericson, Real-Time Collision Detection, 5.1.9)."""

    def one(o: Shapes) -> jax.Array:
        axis_a, axis_b, offset = a.axes[2], o.axes[2], _minus(a.centre, o.centre)
        across = _dot(axis_a, axis_b)
        along_a, along_b = _dot(axis_a, offset), _dot(axis_b, offset)
        # Of parallel lines any point will do; the clips below find its partner.
        s = (across * along_b - along_a) / larger(1 - across * across, 1e-9)
        s = _clip(s, a.size[1])
        t = _clip(along_b + s * across, o.size[1])
        s = _clip(t * across - along_a, a.size[1])
        gap = _minus(offset, _minus(_times(t, axis_b), _times(s, axis_a)))
        return score.of_squared(_dot(gap, gap), a.size[0] + o.size[0])

    return _least(map(one, _each(b)))


def sphere_box(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to boxes whose axes agree up to order and sign: one turn serves all."""
    frame = [[axis[i][0] for i in range(3)] for axis in b.axes]
    points = [_dot(axis, a.centre) for axis in frame]

    def one(o: Shapes) -> jax.Array:
        over = []
        for point, axis in zip(points, frame, strict=True):
            # Which of the box's axes this is: the products are 0, 0 and 1.
            half = sum(jnp.abs(_dot(axis, o.axes[k])) * o.size[k] for k in range(3))
            over.append(jnp.abs(point - _dot(axis, o.centre)) - half)
        beyond = [larger(x, 0.0) for x in over]
        rated = score.of_squared(_dot(beyond, beyond), a.size[0])
        if score.exact:
            rated += smaller(larger(larger(over[0], over[1]), over[2]), 0.0)
        return rated

    return _least(map(one, _each(b)))


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

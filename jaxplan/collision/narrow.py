"""Signed distances between kinds of geoms, batch last, one plain expression per obstacle.

Geoms that face the same obstacles are rows of one array, `[n, B]` for each coordinate,
in the frame of the obstacles' body, where the obstacles are constants; these are a
Python loop over a running minimum. XLA turns it into one vectorised pass over the
cache; boolean reductions, or obstacles as an axis, are ten times slower.
"""

from collections.abc import Callable, Iterator
from functools import partial, reduce

import jax
import jax.numpy as jnp

from jaxplan.collision.shapes import (
    Score,
    Shapes,
    dot,
    larger,
    minus,
    smaller,
    times,
)
from jaxplan.collision.solids import cores_of, farthest


def _clip(x: jax.Array, bound: jax.Array) -> jax.Array:
    return smaller(larger(x, -bound), bound)


def _each(b: Shapes, score: Score) -> Iterator[tuple[Shapes, Score]]:
    """The obstacles one by one, `[B]`, or numbers where the whole batch shares them.

    Numbers, because XLA on CPU takes half the time for them that it takes for rows of one.
    """

    def one(leaf: jax.Array, j: int) -> jax.Array:
        return leaf[j, 0] if leaf.shape[-1] == 1 else leaf[j]

    for j in range(len(b.size[0])):
        yield Shapes(*jax.tree.map(partial(one, j=j), tuple(b)[:3])), score.against(j)


def _least(
    one: Callable[[Shapes, Score], jax.Array], b: Shapes, score: Score
) -> jax.Array:
    """Least score over the obstacles."""
    return reduce(smaller, (one(*pair) for pair in _each(b, score)))


def sphere_plane(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height above the planes."""

    def one(o: Shapes, score: Score) -> jax.Array:
        return score.of(dot(minus(a.centre, o.centre), o.axes[2]), a.size[0])

    return _least(one, b, score)


def convex_plane(kind: str, a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Height of the lowest point."""
    cores = cores_of(kind, a)

    def one(o: Shapes, score: Score) -> jax.Array:
        normal = o.axes[2]
        up = [dot(axis, normal) for axis in a.axes]
        lowest = dot(farthest(cores, [-x for x in up]), up)
        height = dot(minus(a.centre, o.centre), normal) + lowest
        return score.of(height, cores.radius)

    return _least(one, b, score)


def sphere_sphere(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of centres."""

    def one(o: Shapes, score: Score) -> jax.Array:
        offset = minus(a.centre, o.centre)
        return score.of_squared(dot(offset, offset), a.size[0] + o.size[0])

    return _least(one, b, score)


def sphere_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to the nearest point of the capsule's line."""

    def one(o: Shapes, score: Score) -> jax.Array:
        offset = minus(a.centre, o.centre)
        along = _clip(dot(offset, o.axes[2]), o.size[1])
        offset = minus(offset, times(along, o.axes[2]))
        return score.of_squared(dot(offset, offset), a.size[0] + o.size[0])

    return _least(one, b, score)


def capsule_capsule(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance of segments (Ericson, Real-Time Collision Detection, 5.1.9)."""

    def one(o: Shapes, score: Score) -> jax.Array:
        axis_a, axis_b, offset = a.axes[2], o.axes[2], minus(a.centre, o.centre)
        across = dot(axis_a, axis_b)
        along_a, along_b = dot(axis_a, offset), dot(axis_b, offset)
        # Of parallel lines any point will do; the clips below find its partner.
        s = (across * along_b - along_a) / larger(1 - across * across, 1e-9)
        s = _clip(s, a.size[1])
        t = _clip(along_b + s * across, o.size[1])
        s = _clip(t * across - along_a, a.size[1])
        gap = minus(offset, minus(times(t, axis_b), times(s, axis_a)))
        return score.of_squared(dot(gap, gap), a.size[0] + o.size[0])

    return _least(one, b, score)


def sphere_cylinder(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance in the plane through the cylinder's axis."""

    def one(o: Shapes, score: Score) -> jax.Array:
        offset = minus(a.centre, o.centre)
        along = dot(offset, o.axes[2])
        across = minus(offset, times(along, o.axes[2]))
        over = jnp.sqrt(dot(across, across)) - o.size[0], jnp.abs(along) - o.size[1]
        beyond = [larger(x, 0.0) for x in over]
        squared = beyond[0] * beyond[0] + beyond[1] * beyond[1]
        rated = score.of_squared(squared, a.size[0])
        if score.exact:
            rated += smaller(larger(over[0], over[1]), 0.0)
        return rated

    return _least(one, b, score)


def sphere_box(a: Shapes, b: Shapes, score: Score) -> jax.Array:
    """Distance to boxes whose axes agree up to order and sign: one turn serves all."""
    frame = next(_each(b, score))[0].axes
    points = [dot(axis, a.centre) for axis in frame]

    def one(o: Shapes, score: Score) -> jax.Array:
        over = []
        for point, axis in zip(points, frame, strict=True):
            # Which of the box's axes this is: the products are 0, 0 and 1.
            half = sum(jnp.abs(dot(axis, o.axes[k])) * o.size[k] for k in range(3))
            over.append(jnp.abs(point - dot(axis, o.centre)) - half)
        beyond = [larger(x, 0.0) for x in over]
        rated = score.of_squared(dot(beyond, beyond), a.size[0])
        if score.exact:
            rated += smaller(larger(larger(over[0], over[1]), over[2]), 0.0)
        return rated

    return _least(one, b, score)


SOLID = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")
CLOSED: dict[tuple[str, str], Callable[[Shapes, Shapes, Score], jax.Array]] = {
    **{(kind, "plane"): partial(convex_plane, kind) for kind in SOLID},
    ("sphere", "sphere"): sphere_sphere,
    ("sphere", "capsule"): sphere_capsule,
    ("sphere", "cylinder"): sphere_cylinder,
    ("sphere", "box"): sphere_box,
    ("sphere", "plane"): sphere_plane,
    ("capsule", "capsule"): capsule_capsule,
}
"""Least score of each geom of a over the obstacles b, `[n, B]`, by kinds. What is not here
is for `convex`."""

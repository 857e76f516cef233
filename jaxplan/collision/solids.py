"""What a convex geom of each kind is, for `convex`: a core, and a radius around it.

A sphere's core is its centre and a capsule's a segment; that of other geoms is all of
them, and the radius is 0. A mesh is its convex hull, as for MuJoCo. Functions take any
layout whose leaves broadcast.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp

from jaxplan.collision.shapes import Shapes, Vector, dot, larger, once, smaller, where

Best = tuple[jax.Array, Vector]
"""How far along a direction, and the point."""

TINY = 1e-30
CHUNK = 8
"""Vertices of a mesh that are looked at together."""


def radius_of(kind: str, shapes: Shapes) -> jax.Array:
    """How thick a geom is around its core [m]."""
    size = shapes.size[0]
    return size if kind in ("sphere", "capsule") else jnp.zeros_like(size)


def extends(kind: str) -> tuple[int, ...]:
    """Axes along which the core extends."""
    return {"sphere": (), "capsule": (2,)}.get(kind, (0, 1, 2))


def half_extents(kind: str, shapes: Shapes) -> Vector:
    """Half sizes of a box around the core, centred and turned as the geom is [m]."""
    size, zero = shapes.size, jnp.zeros_like(shapes.size[0])
    if kind == "sphere":
        return [zero, zero, zero]
    if kind == "capsule":
        return [zero, zero, size[1]]
    if kind == "cylinder":
        return [size[0], size[0], size[1]]
    if kind == "mesh":
        return [jnp.max(jnp.abs(x), 0) for x in shapes.vertices]
    return size


def inner_radius(kind: str, shapes: Shapes) -> jax.Array:
    """Radius of a ball inside the core, around the geom's centre [m]."""
    if kind == "mesh":  # the centre of mass, of which no more is known
        return jnp.zeros_like(shapes.size[0])
    half = half_extents(kind, shapes)
    return smaller(smaller(half[0], half[1]), half[2])


def farthest(kind: str, shapes: Shapes, along: Vector) -> Vector:
    """The core's point that lies farthest along a direction, in the geom's frame.

    Args:
        kind: Of the geoms.
        shapes: The geoms.
        along: Directions in the geoms' frames, of any length.
    """
    size, zero = shapes.size, jnp.zeros_like(along[0])
    if kind == "sphere":
        return [zero, zero, zero]
    if kind == "capsule":
        return [zero, zero, _signed(size[1], along[2])]
    if kind == "cylinder":
        across = along[0] * along[0] + along[1] * along[1]
        scale = size[0] / jnp.sqrt(larger(across, TINY))
        return [scale * along[0], scale * along[1], _signed(size[1], along[2])]
    if kind == "ellipsoid":
        scaled = [s * x for s, x in zip(size, along, strict=True)]
        scale = 1 / jnp.sqrt(larger(dot(scaled, scaled), TINY))
        return [scale * s * x for s, x in zip(size, scaled, strict=True)]
    if kind == "box":
        return [_signed(s, x) for s, x in zip(size, along, strict=True)]
    return _farthest_vertex(shapes.vertices, along)


def _signed(size: jax.Array, sign: jax.Array) -> jax.Array:
    return jnp.where(sign < 0, -size, size)


def _farthest_vertex(vertices: Sequence[jax.Array], along: Vector) -> Vector:
    """By a loop over chunks: a hull of hundreds compiles as fast as one of eight."""
    missing = -len(vertices[0]) % CHUNK
    filled = [jnp.concatenate([x, jnp.repeat(x[:1], missing, 0)]) for x in vertices]
    table = jnp.stack(filled, 1)
    chunks = table.reshape(-1, CHUNK, *table.shape[1:])

    def look(best: Best, chunk: jax.Array) -> tuple[Best, None]:
        height, point = best
        # Were heights computed again for each coordinate, and rounded in
        # another way, the point would be made of two vertices.
        new = [dot(list(vertex), along) for vertex in chunk]
        for own, vertex in zip(once(new), chunk, strict=True):
            higher = own > height
            height = jnp.where(higher, own, height)
            point = where(higher, list(vertex), point)
        return (height, point), None

    zero = jnp.zeros_like(along[0])
    return jax.lax.scan(look, (zero - jnp.inf, [zero] * 3), chunks)[0][1]

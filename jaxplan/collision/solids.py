"""What a convex geom is to `convex`, whatever its kind: a core, and a radius around it.

A core is the Minkowski sum of a box, a disc, an ellipsoid and the hull of some vertices,
all but one or two of them mere points: a capsule is a segment with a radius, a cylinder a
segment and a disc. So one compiled search serves every kind, and a mesh costs one more.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision.shapes import (
    Shapes,
    Vector,
    dot,
    larger,
    once,
    plus,
    smaller,
    where,
)

TINY = 1e-30
CHUNK = 8
"""Vertices of a mesh that are looked at together."""


class Cores(NamedTuple):
    """Convex geoms of any kind; leaves `[n, B]` or `[n, 1]`."""

    centre: Vector
    axes: list[Vector]
    box: Vector
    """Half sizes [m]."""
    disc: jax.Array
    """Radius of a disc across the z axis [m]."""
    ball: Vector
    """Half axes of an ellipsoid [m]."""
    bounds: Vector
    """Half sizes of a box around the core [m]."""
    inner: jax.Array
    """Radius of a ball in the core, around the geom's centre [m]."""
    radius: jax.Array
    """Of what is around the core: that of spheres and capsules [m]."""
    vertices: tuple[jax.Array, ...] = ()
    """In the geoms' own frames, each `[V, n, 1]` [m]; none: no mesh among them."""


def cores_of(kind: str, shapes: Shapes) -> Cores:
    """Geoms of one kind. A mesh is its convex hull, as for MuJoCo."""
    size, zero = shapes.size, jnp.zeros_like(shapes.size[0])
    nothing = [zero, zero, zero]
    box = {"box": size, "capsule": [zero, zero, size[1]]}
    box["cylinder"] = box["capsule"]
    disc = size[0] if kind == "cylinder" else zero
    parts = (
        box.get(kind, nothing),
        [disc, disc, zero],
        size if kind == "ellipsoid" else nothing,
        [jnp.max(jnp.abs(x), 0) for x in shapes.vertices] or nothing,
    )
    bounds = [jnp.broadcast_to(sum(x), zero.shape) for x in zip(*parts, strict=True)]
    least = smaller(smaller(bounds[0], bounds[1]), bounds[2])
    return Cores(
        centre=shapes.centre,
        axes=shapes.axes,
        box=parts[0],
        disc=disc,
        ball=parts[2],
        bounds=bounds,
        # Of a mesh no more is known than that its centre of mass is in it.
        inner=zero if kind == "mesh" else least,
        radius=size[0] if kind in ("sphere", "capsule") else zero,
        vertices=shapes.vertices,
    )


def stacked(parts: Sequence[Cores]) -> Cores:
    """All geoms as rows, one part after the other."""
    longest = max((len(x) for part in parts for x in part.vertices), default=0)

    def filled(part: Cores) -> Cores:
        if not longest:
            return part
        own = part.vertices or (jnp.zeros((1, len(part.disc), 1), jnp.float32),) * 3
        fill = [(0, longest - len(own[0])), (0, 0), (0, 0)]
        padded = (jnp.pad(x, fill, mode="edge") for x in own)
        return part._replace(vertices=tuple(padded))

    def join(*leaves: jax.Array) -> jax.Array:
        last = max(leaf.shape[-1] for leaf in leaves)
        wide = [jnp.broadcast_to(x, (*x.shape[:-1], last)) for x in leaves]
        return jnp.concatenate(wide, axis=-2)

    return jax.tree.map(join, *map(filled, parts))


def farthest(cores: Cores, along: Vector) -> Vector:
    """The core's point that lies farthest along a direction, in the geom's frame.

    Args:
        cores: The geoms.
        along: Directions in the geoms' frames, of any length.
    """
    across = along[0] * along[0] + along[1] * along[1]
    disc = cores.disc / jnp.sqrt(larger(across, TINY))
    scaled = [s * x for s, x in zip(cores.ball, along, strict=True)]
    ball = 1 / jnp.sqrt(larger(dot(scaled, scaled), TINY))
    point = [
        jnp.where(x < 0, -half, half) + ball * s * y
        for half, x, s, y in zip(cores.box, along, cores.ball, scaled, strict=True)
    ]
    point = [point[0] + disc * along[0], point[1] + disc * along[1], point[2]]
    if cores.vertices:
        point = plus(point, _farthest_vertex(cores.vertices, along))
    return point


def _farthest_vertex(vertices: Sequence[jax.Array], along: Vector) -> Vector:
    """By a loop over chunks: a hull of hundreds compiles as fast as one of eight."""
    missing = -len(vertices[0]) % CHUNK
    filled = [jnp.concatenate([x, jnp.repeat(x[:1], missing, 0)]) for x in vertices]
    table = jnp.stack(filled, 1)
    chunks = table.reshape(-1, CHUNK, *table.shape[1:])

    def look(best: tuple[jax.Array, Vector], chunk: jax.Array):
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

"""What a convex geom is to `convex`, whatever its kind: a core, and a radius around it.

A core is the Minkowski sum of a box, a disc, an ellipsoid and the hull of some vertices,
all but one or two of them mere points: a capsule is a segment with a radius, a cylinder a
segment and a disc. So one compiled search serves every kind.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision.hulls import TINY, Hulls, joined
from jaxplan.collision.shapes import (
    Shapes,
    Vector,
    dot,
    larger,
    plus,
    smaller,
)


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
    hulls: Hulls | None = None
    """None: no mesh among them."""


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
        [*shapes.hulls.bounds] if shapes.hulls else nothing,
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
        hulls=shapes.hulls,
    )


def stacked(parts: Sequence[Cores]) -> Cores:
    """All geoms as rows, one part after the other."""

    def join(*leaves: jax.Array) -> jax.Array:
        last = max(leaf.shape[-1] for leaf in leaves)
        wide = [jnp.broadcast_to(x, (*x.shape[:-1], last)) for x in leaves]
        return jnp.concatenate(wide, axis=-2)

    hulls = joined([(part.hulls, len(part.disc)) for part in parts])
    bare = [part._replace(hulls=None) for part in parts]
    return jax.tree.map(join, *bare)._replace(hulls=hulls)


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
    return plus(point, cores.hulls.farthest(along)) if cores.hulls else point

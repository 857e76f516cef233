"""The point of a convex set next to the origin: GJK without branches, batch last.

Gilbert, Johnson & Keerthi (1988): from a triangle of the set that holds the nearest
point so far, go to the set's point farthest against it, and find what of that
tetrahedron is nearest.

Each candidate is a convex combination that is evaluated, and the least wins. So
rounding in float32, flat tetrahedra and doubled corners can spoil a step, but never
bring the set nearer than it is.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision.shapes import (
    Vector,
    cross,
    dot,
    larger,
    minus,
    once,
    smaller,
    times,
    total,
    where,
)
from jaxplan.collision.solids import TINY

MAX_STEPS = 32
"""Polytopes take about 10; what is round comes ever nearer."""
PRECISION = 1e-6
"""Distances are found to this [m]; a set this near to the origin, in proportion to its
size, holds it."""
Support = Callable[[Vector], Vector]
"""The point of a convex set that lies farthest against a direction."""


class _State(NamedTuple):
    """Where the search is."""

    corners: list[Vector]
    """Three points of the set."""
    nearest: Vector
    """The point of their triangle next to the origin, each `[...]`."""
    squared: jax.Array
    """Its squared distance [m^2]; exactly 0 where the set holds the origin."""
    apart: jax.Array
    """1 where a plane was found between the set and the origin, at the reach or beyond."""
    steps: jax.Array
    open: jax.Array
    """Whether some set is not settled."""


def nearest_point(
    support: Support, start: Vector, reach: jax.Array | float | None = None
) -> tuple[Vector, jax.Array]:
    """The point of each set next to the origin, and its squared distance.

    Args:
        support: Of the sets.
        start: A point of each, `[...]`.
        reach: If given, only whether the distance is above it is found out [m].

    Returns:
        Three coordinates `[...]` [m], and `[...]` [m^2], exactly 0 where the set holds
        the origin or rounding leaves it open. With a reach, the square is above that of
        the reach only where a plane proves it.
    """
    square, zero = dot(start, start), jnp.zeros_like(start[0])
    limit = zero if reach is None else reach

    def step(state: _State) -> _State:
        corners, nearest, squared = state.corners, state.nearest, state.squared
        new = once(support(nearest))
        edges = [minus(corner, new) for corner in corners]
        size = dot(new, new) + total(dot(edge, edge) for edge in edges)
        contact = PRECISION**2 * size
        weights, better = _next_to_origin(new, edges, squared, contact)
        inside = _combined(new, edges, weights)
        least = dot(inside, inside)
        least = jnp.where(least < contact, 0.0, least)
        progress = dot(nearest, new)
        apart = (progress > 0) & (progress * progress > limit * limit * squared)
        open = better & (squared - progress > PRECISION * jnp.sqrt(squared))
        if reach is not None:
            open &= (squared > limit * limit) & ~apart
        return _State(
            # A corner without weight makes room for the new one.
            [where(better & (weights[i] == 0), new, corners[i]) for i in range(3)],
            where(better, inside, nearest),
            jnp.where(better, least, squared),
            jnp.where(apart, 1.0, state.apart),
            state.steps + 1,
            # A maximum of floats is vectorised, `any` is not.
            jnp.max(open.astype(square.dtype)),
        )

    def unsettled(state: _State) -> jax.Array:
        return (state.open > 0) & (state.steps < MAX_STEPS)

    first = _State(
        [start] * 3, start, square, zero, jnp.array(0), jnp.ones((), square.dtype)
    )
    last = jax.lax.while_loop(unsettled, step, first)
    # Searches that stall in flat tetrahedra have found a near point, and no proof.
    unproved = smaller(last.squared, limit * limit)
    return last.nearest, jnp.where(last.apart > 0, last.squared, unproved)


def _next_to_origin(
    new: Vector, edges: list[Vector], squared: jax.Array, contact: jax.Array
) -> tuple[dict[int, jax.Array], jax.Array]:
    """Which point of a tetrahedron is next to the origin.

    The old triangle's nearest point is known, so only what holds the new corner counts:
    three edges, three faces, and all of it.

    Args:
        new: The new corner.
        edges: From it to the others.
        squared: Squared distance of the old triangle [m^2].
        contact: That which counts as none [m^2].

    Returns:
        Weights of the edges, and whether that is nearer than the old triangle.
    """
    moments = [cross(edge, new) for edge in edges]
    normals = [cross(edges[k - 2], edges[k - 1]) for k in range(3)]
    candidates: list[dict[int, jax.Array]] = []
    for i, edge in enumerate(edges):
        square = larger(dot(edge, edge), TINY)
        share = -dot(new, edge) / square
        share -= dot(_combined(new, edges, {i: share}), edge) / square
        candidates.append({i: smaller(larger(share, 0.0), 1.0)})
    for k, normal in enumerate(normals):
        i, j, area = (k + 1) % 3, (k + 2) % 3, larger(dot(normal, normal), TINY)
        u, v = dot(moments[j], normal) / area, -dot(moments[i], normal) / area
        left = _combined(new, edges, {i: u, j: v})
        u += dot(cross(edges[j], left), normal) / area
        v -= dot(cross(edges[i], left), normal) / area
        candidates.append(dict(zip((i, j), _clipped([u, v]), strict=True)))
    volume = dot(edges[0], normals[0])
    volume = jnp.where(jnp.abs(volume) < TINY, TINY, volume)
    shares = [-dot(new, normal) / volume for normal in normals]
    # Of a flat tetrahedron they are rough; what is left over says by how much.
    left = _combined(new, edges, dict(enumerate(shares)))
    shares = [x - dot(left, n) / volume for x, n in zip(shares, normals, strict=True)]
    shares = _clipped(shares)
    candidates.append(dict(enumerate(shares)))
    candidates = once(candidates)

    least, choice = squared, jnp.full_like(squared, -1)
    for k, shares in enumerate(candidates):
        point = _combined(new, edges, shares)
        length = dot(point, point)
        if len(shares) == 3:  # counts only where it holds the origin: that ends it
            length = jnp.where(length < contact, length, jnp.inf)
        choice = jnp.where(length < least, float(k), choice)
        least = smaller(length, least)
    choice = once(choice)
    weights = [jnp.zeros_like(squared)] * 3
    for k, shares in enumerate(candidates):
        for i, share in shares.items():
            weights[i] = jnp.where(choice == k, share, weights[i])
    return dict(enumerate(weights)), choice >= 0


def _combined(
    new: Vector, edges: list[Vector], weights: dict[int, jax.Array]
) -> Vector:
    """The point that some weights of the edges give."""
    return [
        x + total(weight * edges[i][k] for i, weight in weights.items())
        for k, x in enumerate(new)
    ]


def _clipped(weights: list[jax.Array]) -> list[jax.Array]:
    """Weights made those of some point inside."""
    weights = [larger(w, 0.0) for w in weights]
    return times(1 / larger(total(weights), 1.0), weights)

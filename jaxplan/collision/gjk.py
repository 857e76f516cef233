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
        the origin.
    """

    def step(state: _State) -> _State:
        corners, nearest, squared = state.corners, state.nearest, state.squared
        # The barriers here and below: XLA would compute all of it again for each use.
        new = jax.lax.optimization_barrier(support(nearest))
        edges = [minus(corner, new) for corner in corners]
        weights, least = _next_to_origin(new, edges)
        better = least < squared
        progress = dot(nearest, new)
        open = better & (squared - progress > PRECISION * jnp.sqrt(squared))
        if reach is not None:
            apart = (progress > 0) & (progress * progress > reach * reach * squared)
            open &= (squared > reach * reach) & ~apart
        inside = [
            new[x] + total(w * e[x] for w, e in zip(weights, edges, strict=True))
            for x in range(3)
        ]
        kept = [
            where(better, where(w > 0, c, new), c)
            for w, c in zip(weights, corners, strict=True)
        ]
        return _State(
            kept,
            where(better, inside, nearest),
            jnp.where(better, least, squared),
            state.steps + 1,
            # A maximum of floats is vectorised, `any` is not.
            jnp.max(jnp.where(open, 1.0, 0.0)),
        )

    def unsettled(state: _State) -> jax.Array:
        return (state.open > 0) & (state.steps < MAX_STEPS)

    first = _State([start] * 3, start, dot(start, start), jnp.array(0), jnp.array(1.0))
    last = jax.lax.while_loop(unsettled, step, first)
    return last.nearest, last.squared


def _next_to_origin(
    new: Vector, edges: list[Vector]
) -> tuple[list[jax.Array], jax.Array]:
    """Which point of a tetrahedron is next to the origin.

    The old triangle's nearest point is known, so only what holds the new corner counts.

    Args:
        new: The new corner.
        edges: From it to the others.

    Returns:
        Weights of the edges, and the squared distance.
    """
    squares = [dot(edge, edge) for edge in edges]
    moments = [cross(edge, new) for edge in edges]
    normals = [cross(edges[k - 2], edges[k - 1]) for k in range(3)]
    candidates: list[dict[int, jax.Array]] = []
    for i in range(3):
        share = -dot(new, edges[i]) / larger(squares[i], TINY)
        candidates.append({i: smaller(larger(share, 0.0), 1.0)})
    for k in range(3):
        i, j, area = (k + 1) % 3, (k + 2) % 3, larger(dot(normals[k], normals[k]), TINY)
        u, v = dot(moments[j], normals[k]) / area, -dot(moments[i], normals[k]) / area
        candidates.append(dict(zip((i, j), _clipped([u, v]), strict=True)))
    volume = dot(edges[0], normals[0])
    volume = jnp.where(jnp.abs(volume) < TINY, TINY, volume)
    shares = _clipped([-dot(new, normal) / volume for normal in normals])
    candidates.append(dict(enumerate(shares)))
    candidates = jax.lax.optimization_barrier(candidates)

    contact = PRECISION**2 * (dot(new, new) + total(squares))
    least, choice = dot(new, new), jnp.full(new[0].shape, -1)
    for k, shares in enumerate(candidates):
        point = [
            new[x] + total(w * edges[i][x] for i, w in shares.items()) for x in range(3)
        ]
        squared = dot(point, point)
        if len(shares) == 3:  # counts only where it holds the origin: then all is said
            squared = jnp.where(squared < contact, squared, jnp.inf)
        choice = jnp.where(squared < least, k, choice)
        least = smaller(squared, least)
    choice, least = jax.lax.optimization_barrier((choice, least))
    weights = [jnp.zeros_like(least)] * 3
    for k, shares in enumerate(candidates):
        for i, share in shares.items():
            weights[i] = jnp.where(choice == k, share, weights[i])
    least = jnp.where(least < contact, 0.0, least)
    return jax.lax.optimization_barrier((weights, least))


def _clipped(weights: list[jax.Array]) -> list[jax.Array]:
    """Weights made those of some point inside."""
    weights = [larger(w, 0.0) for w in weights]
    return times(1 / larger(total(weights), 1.0), weights)

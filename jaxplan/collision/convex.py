"""Signed distance of any two convex geoms, whatever their kinds.

The points a - b of two geoms form a convex set that holds the origin where the geoms
meet, and whose distance from the origin is theirs. Spheres and capsules enter as a
point and a segment with a radius.

Of most pairs a look at their boxes says enough. The others are gathered and searched a
tile at a time, so that no pair waits for another in a distant part of the batch.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision.gjk import Support, nearest_point
from jaxplan.collision.shapes import (
    Score,
    Shapes,
    Vector,
    cross,
    dot,
    larger,
    minus,
    once,
    plus,
    times,
    where,
)
from jaxplan.collision.solids import (
    TINY,
    extends,
    farthest,
    half_extents,
    inner_radius,
    radius_of,
)

Best = tuple[jax.Array, Vector]
"""A signed distance found [m], and the direction."""

TILE = 256
"""Pairs that are searched together: few enough for the cache."""
ROUNDS = 2
"""Searches for a shorter way out of something round or a mesh, see `_depth`."""


def convex_convex(
    kinds: tuple[str, str], a: Shapes, b: Shapes, score: Score
) -> jax.Array:
    """Least score of each geom of a over the obstacles b.

    Args:
        kinds: Of a and of b; no planes.
        a: Leaves `[n, B]` or `[n, 1]`.
        b: Leaves `[m, B]` or `[m, 1]`.
        score: What is rated.

    Returns:
        `[n, B]`. Distances are good to some micrometres. Where geoms penetrate, the
        depth is exact between spheres, capsules and boxes and wherever the cores do not
        meet; otherwise it is that of some way out, so an upper bound (`_depth`).
    """
    one, other = kinds
    facing = Shapes(*jax.tree.map(lambda leaf: leaf[:, None], tuple(b)[:3]))
    radius = radius_of(one, a) + radius_of(other, facing)
    least, most = _bounds(kinds, a, b)
    if score.exact:  # the slack is for rounding
        near = least - radius <= jnp.min(most - radius, 0) + 1e-4
    else:
        near = least <= radius + score.margin

    def squared(pair: Pair) -> jax.Array:
        reach = None if score.exact else pair.radius + score.margin
        return nearest_point(pair.support, pair.offset, reach)[1]

    def depth(pair: Pair) -> jax.Array:
        return _depth(pair, 0 if set(kinds) <= {"sphere", "capsule", "box"} else ROUNDS)

    found = _in_tiles(squared, kinds, a, b, near, jnp.inf)
    scores = score.of_squared(found, radius)
    if score.exact:
        scores -= _in_tiles(depth, kinds, a, b, found == 0, 0.0)
    return jnp.min(scores, 0)


class Pair(NamedTuple):
    """A geom and an obstacle in the obstacle's frame, where rounding is least."""

    support: Support
    """Of the points a - b."""
    offset: Vector
    """From the obstacle's centre to the geom's, each `[tile]` [m]."""
    axes: list[Vector]
    """The geom's."""
    radius: jax.Array
    """Of both together [m]."""


def _pair(kinds: tuple[str, str], a: Shapes, b: Shapes) -> Pair:
    """Leaves `[tile]`."""
    one, other = kinds
    offset = [dot(axis, minus(a.centre, b.centre)) for axis in b.axes]
    axes = [[dot(axis, own) for axis in b.axes] for own in a.axes]
    offset, axes = once((offset, axes))

    def support(against: Vector) -> Vector:
        own = once(farthest(one, a, [-dot(axis, against) for axis in axes]))
        point = minus(offset, farthest(other, b, against))
        for i in extends(one):
            point = plus(point, times(own[i], axes[i]))
        return point

    return Pair(support, offset, axes, radius_of(one, a) + radius_of(other, b))


def _bounds(
    kinds: tuple[str, str], a: Shapes, b: Shapes
) -> tuple[jax.Array, jax.Array]:
    """The signed distance of the cores is at least and at most this, `[m, n, B]` [m]."""
    half_a, half_b = half_extents(kinds[0], a), half_extents(kinds[1], b)
    inner = inner_radius(kinds[0], a) + inner_radius(kinds[1], b)[:, None]
    b = Shapes(*jax.tree.map(lambda leaf: leaf[:, None], tuple(b)[:3]))
    offset = [dot(axis, minus(a.centre, b.centre)) for axis in b.axes]
    beyond = []
    for k in range(3):
        extent = half_b[k][:, None]
        for i in extends(kinds[0]):
            extent = extent + jnp.abs(dot(b.axes[k], a.axes[i])) * half_a[i]
        beyond.append(larger(jnp.abs(offset[k]) - extent, 0.0))
    gap = jnp.sqrt(dot(beyond, beyond))
    least = jnp.where(gap > 0, gap, -jnp.inf)  # boxes that meet say nothing of depth
    return least, jnp.sqrt(dot(offset, offset)) - inner


def _in_tiles(
    function: Callable[[Pair], jax.Array],
    kinds: tuple[str, str],
    a: Shapes,
    b: Shapes,
    chosen: jax.Array,
    otherwise: float,
) -> jax.Array:
    """`function` of the chosen pairs `[m, n, B]`, a tile of them at a time on a CPU."""
    size = chosen.size
    tile = min(TILE, size) if jax.default_backend() == "cpu" else size
    slots = -(-size // tile) * tile
    (order,) = jnp.nonzero(chosen.reshape(-1), size=slots, fill_value=size)
    count = jnp.sum(chosen)

    def pick(shapes: Shapes, rows: jax.Array, columns: jax.Array) -> Shapes:
        def one(leaf: jax.Array) -> jax.Array:
            return leaf[rows, columns if leaf.shape[-1] > 1 else 0]

        picked = Shapes(*jax.tree.map(one, tuple(shapes)[:3]))
        return picked._replace(vertices=[x[:, rows, 0] for x in shapes.vertices])

    def search(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        done, values = state
        places = jax.lax.dynamic_slice(order, (done,), (tile,))
        j, i, k = jnp.unravel_index(places, chosen.shape)
        found = function(_pair(kinds, pick(a, i, k), pick(b, j, k)))
        return done + tile, values.at[places].set(found, mode="drop")

    values = jnp.full(size, otherwise)
    start = jnp.array(0), values
    _, values = jax.lax.while_loop(lambda state: state[0] < count, search, start)
    return values.reshape(chosen.shape)


def _depth(pair: Pair, rounds: int) -> jax.Array:
    """How far the geom's core can be moved to leave the obstacle's, `[tile]` [m].

    Tries the line between the centres, both geoms' axes and their cross products, which
    is all that boxes need; then moves the geom just beyond the best way out, and
    tries the direction that is nearest from there. Each try is a way out, so that the
    depth is never less than the true one.
    """
    one = jnp.ones_like(pair.offset[0])
    own = [[one * (i == k) for i in range(3)] for k in range(3)]
    edges = [cross(x, y) for x in own for y in pair.axes]
    ways = jnp.array([_unit(way) for way in (pair.offset, *own, *pair.axes, *edges)])

    def attempt(best: Best, way: Vector) -> Best:
        gap = dot(way, pair.support(way))
        # The cross product of parallel axes is no direction.
        better = (gap > best[0]) & (dot(way, way) > 0.5)
        return jnp.where(better, gap, best[0]), where(better, way, best[1])

    def both(best: Best, way: jax.Array) -> tuple[Best, None]:
        return attempt(attempt(best, list(way)), list(-way)), None

    def refine(_: int, best: Best) -> Best:
        shift = times(1e-4 - best[0], best[1])

        def support(against: Vector) -> Vector:
            return plus(pair.support(against), shift)

        nearest, _squared = nearest_point(support, plus(pair.offset, shift))
        return attempt(best, _unit(nearest))

    best, _ = jax.lax.scan(both, (one - jnp.inf, own[0]), ways)
    return -(jax.lax.fori_loop(0, rounds, refine, best) if rounds else best)[0]


def _unit(x: Vector) -> Vector:
    return times(1 / jnp.sqrt(larger(dot(x, x), TINY)), x)

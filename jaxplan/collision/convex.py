"""Signed distance of any two convex geoms, whatever their kinds.

The points a - b of two geoms form a convex set that holds the origin where the geoms
meet, and whose distance from the origin is theirs. Spheres and capsules enter as a
point and a segment with a radius.

All pairs of a scene go the same way, so that it compiles once. Of most a look at balls,
then at boxes says enough. The others are gathered and searched a tile at a time, so that
no pair waits for another in a distant part of the batch.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.gjk import nearest_point
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
    smaller,
    times,
    where,
)
from jaxplan.collision.solids import TINY, Cores, cores_of, farthest, stacked

Best = tuple[jax.Array, Vector]
"""A signed distance found [m], and the direction."""

TILE = 64
"""Pairs that are searched together: few enough for the cache."""
ROUNDS = 2
"""Searches for a shorter way out of something round or a mesh, see `_depth`."""
SLACK = 1e-4
"""Bounds that differ by less [m] may be rounding."""


def least_convex(
    parts: Sequence[tuple[str, Shapes]],
    pairs: np.ndarray,
    counts: jax.Array,
    score: Score,
) -> jax.Array:
    """Least score over pairs of convex geoms, no planes.

    Args:
        parts: Geoms in one frame by kind, leaves `[n, B]` or `[n, 1]`.
        pairs: `[P, 2]` geoms, counted through all parts.
        counts: `[P, B]` or `[P, 1]` whether a pair counts.
        score: What is rated.

    Returns:
        `[B]`, infinite where nothing counts. Distances are good to some micrometres. Where
        geoms penetrate, the depth is exact between spheres, capsules and boxes and wherever
        the cores do not meet; otherwise it is that of some way out, so an upper bound
        (`_depth`).
    """
    cores = stacked([cores_of(kind, shapes) for kind, shapes in parts])
    a, b = pairs.T
    radius = cores.radius[a] + cores.radius[b]
    least, most = _balls(cores, a, b)
    if score.exact:
        nearest = jnp.where(counts, most - radius - score.margin, jnp.inf)
        reach = jnp.min(nearest, 0) + SLACK + score.margin
    else:
        reach = score.margin
    near = (least - radius <= reach) & counts
    tiles = partial(_in_tiles, cores, a, b, score.margin)
    lower = tiles(_box_gap, near, jnp.inf) - radius
    if not score.exact:
        found = tiles(partial(_squared, False), near & (lower <= reach), jnp.inf)
        return jnp.min(score.of_squared(found, radius), 0)
    lower -= score.margin
    simple = {kind for kind, _ in parts} <= {"sphere", "capsule", "box"}
    depth = partial(_depth, 0 if simple else ROUNDS)

    def search(least: jax.Array, limit: jax.Array) -> jax.Array:
        chosen = near & (lower <= limit)
        found = tiles(partial(_squared, True), chosen, jnp.inf)
        scores = score.of_squared(found, radius)
        scores -= tiles(depth, chosen & (found == 0), 0.0)
        return smaller(jnp.min(scores, 0), least)

    # First what can be the nearest, then all that may be nearer than it is.
    first = jnp.min(jnp.where(near, lower, jnp.inf), 0)
    nothing = jnp.full_like(first, jnp.inf)
    return jax.lax.fori_loop(
        0, 2, lambda k, least: search(least, jnp.where(k == 0, first, least)), nothing
    )


def _balls(cores: Cores, a: np.ndarray, b: np.ndarray) -> tuple[jax.Array, jax.Array]:
    """The signed distance of cores is at least and at most this, `[P, B]` [m]."""
    outer = jnp.sqrt(dot(cores.bounds, cores.bounds))
    offset = [x[a] - x[b] for x in cores.centre]
    distance = jnp.sqrt(dot(offset, offset))
    least = distance - (outer[a] + outer[b])
    # Balls that meet say nothing of depth.
    least = jnp.where(least > 0, least, -jnp.inf)
    return least, distance - (cores.inner[a] + cores.inner[b])


class Pair(NamedTuple):
    """Geoms a and b in b's frame, where rounding is least; leaves `[tile]`."""

    a: Cores
    b: Cores
    offset: Vector
    """From b's centre to a's [m]."""
    axes: list[Vector]
    """Those of a."""
    margin: jax.Array | float
    """`[tile]`, or one for all [m]."""

    def support(self, against: Vector) -> Vector:
        """The point of the a - b that lies farthest against a direction."""
        own = farthest(self.a, [-dot(axis, against) for axis in self.axes])
        own = once(own)
        point = minus(self.offset, farthest(self.b, against))
        for x, axis in zip(own, self.axes, strict=True):
            point = plus(point, times(x, axis))
        return point


def _in_tiles(
    cores: Cores,
    a: np.ndarray,
    b: np.ndarray,
    margin: jax.Array | float,
    function: Callable[[Pair], jax.Array],
    chosen: jax.Array,
    otherwise: float,
) -> jax.Array:
    """`function` of the chosen pairs `[P, B]`, a tile of them at a time on a CPU."""
    size = chosen.size
    tile = min(TILE, size) if jax.default_backend() == "cpu" else size
    slots = -(-size // tile) * tile
    (order,) = jnp.nonzero(chosen.reshape(-1), size=slots, fill_value=size)
    count = jnp.sum(chosen)

    def pick(rows: jax.Array, columns: jax.Array) -> Cores:
        def one(leaf: jax.Array) -> jax.Array:
            return leaf[rows, columns if leaf.shape[-1] > 1 else 0]

        picked = jax.tree.map(one, cores._replace(hulls=None))
        own = cores.hulls and cores.hulls._replace(row=cores.hulls.row[rows, 0])
        return picked._replace(hulls=own)

    def own_margin(rows: jax.Array, columns: jax.Array) -> jax.Array | float:
        if not isinstance(margin, jax.Array) or margin.ndim == 0:
            return margin
        return margin[rows, columns if margin.shape[-1] > 1 else 0]

    def search(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        done, values = state
        places = jax.lax.dynamic_slice(order, (done,), (tile,))
        row, column = jnp.unravel_index(places, chosen.shape)
        one = pick(jnp.asarray(a)[row], column)
        other = pick(jnp.asarray(b)[row], column)
        offset = [dot(axis, minus(one.centre, other.centre)) for axis in other.axes]
        axes = [[dot(axis, own) for axis in other.axes] for own in one.axes]
        offset, axes = once((offset, axes))
        found = function(Pair(one, other, offset, axes, own_margin(row, column)))
        return done + tile, values.at[places].set(found, mode="drop")

    values = jnp.full(size, otherwise, cores.radius.dtype)
    start = jnp.array(0), values
    _, values = jax.lax.while_loop(lambda state: state[0] < count, search, start)
    return values.reshape(chosen.shape)


def _box_gap(pair: Pair) -> jax.Array:
    """The signed distance of the cores is at least that, `[tile]` [m]: of boxes around them."""
    back = [list(column) for column in zip(*pair.axes, strict=True)]
    own = [dot(axis, pair.offset) for axis in pair.axes]
    a, b = pair.a.bounds, pair.b.bounds
    return larger(_over(pair.offset, b, a, pair.axes), _over(own, a, b, back))


def _over(offset: Vector, own: Vector, other: Vector, axes: list[Vector]) -> jax.Array:
    """How far another box is from one, along the one's axes; its own axes are in that frame."""
    over = []
    for k in range(3):
        extent = own[k]
        for half, axis in zip(other, axes, strict=True):
            extent = extent + jnp.abs(axis[k]) * half
        over.append(jnp.abs(offset[k]) - extent)
    most = larger(larger(over[0], over[1]), over[2])
    beyond = [larger(x, 0.0) for x in over]
    return jnp.where(most > 0, jnp.sqrt(dot(beyond, beyond)), most)


def _squared(exact: bool, pair: Pair) -> jax.Array:
    """Squared distance of the cores, `[tile]` [m^2]."""
    reach = None if exact else pair.a.radius + pair.b.radius + pair.margin
    return nearest_point(pair.support, pair.offset, reach)[1]


def _depth(rounds: int, pair: Pair) -> jax.Array:
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
    ways = jnp.concatenate([ways, -ways])

    def attempt(best: Best, way: Vector) -> Best:
        gap = dot(way, pair.support(way))
        # The cross product of parallel axes is no direction.
        better = (gap > best[0]) & (dot(way, way) > 0.5)
        return jnp.where(better, gap, best[0]), where(better, way, best[1])

    def each(best: Best, way: jax.Array) -> tuple[Best, None]:
        return attempt(best, list(way)), None

    def refine(_: int, best: Best) -> Best:
        shift = times(1e-4 - best[0], best[1])

        def support(against: Vector) -> Vector:
            return plus(pair.support(against), shift)

        nearest, _squared = nearest_point(support, plus(pair.offset, shift))
        return attempt(best, _unit(nearest))

    best, _ = jax.lax.scan(each, (one - jnp.inf, own[0]), ways)
    return -(jax.lax.fori_loop(0, rounds, refine, best) if rounds else best)[0]


def _unit(x: Vector) -> Vector:
    return times(1 / jnp.sqrt(larger(dot(x, x), TINY)), x)

"""Convex hulls of meshes: which vertex lies farthest along a direction.

Directions are sorted into cells, the squares of a grid on each face of a cube. Of a cell
it is known which vertices can be the farthest: some few of hundreds, and only these are
looked at. A vertex is left out where another one lies farther in all four corners of the
cell, hence everywhere in it; so the answer is that of a look at all.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

GRID = 16
"""Squares along an edge of the cube, a power of 2."""
CELLS = 6 * GRID * GRID
CHUNK = 8
"""Vertices that are looked at together."""
TINY = 1e-30
ROUNDING = 1e-6
"""Of heights, in proportion to the hull's size."""
BORDER = 1e-3
"""Cells overlap by this, so that rounding may choose the neighbour."""


class Hulls(NamedTuple):
    """Hulls of some geoms, in the geoms' own frames."""

    row: jax.Array
    """Which of the hulls is the geom's, `[n, 1]`."""
    bounds: jax.Array
    """Half sizes of a box around each geom's, `[3, n, 1]` [m]."""
    radius: jax.Array
    """Of a ball around each geom's, `[n, 1]` [m]."""
    first: jax.Array
    """Where the vertices of a cell begin, `[H * CELLS + 1]`, one hull after the other."""
    vertices: jax.Array
    """`[3, L]` [m]."""

    def farthest(self, along: list[jax.Array]) -> list[jax.Array]:
        """The vertex that lies farthest along each geom's direction, of any length."""
        cell = self.row * CELLS + _cell(along)
        first = self.first[cell]
        last = self.first[cell + 1] - 1
        most = jnp.max(last - first)
        steps = jnp.arange(CHUNK, dtype=first.dtype).reshape(-1, *[1] * cell.ndim)

        def look(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
            done, highest, best = state
            places = jnp.minimum(first + done + steps, last)
            x, y, z = self.vertices[:, places]
            heights = x * along[0] + y * along[1] + z * along[2]
            for place, height in zip(places, heights, strict=True):
                best = jnp.where(height > highest, place, best)
                highest = jnp.where(height > highest, height, highest)
            return done + CHUNK, highest, best

        nothing = jnp.full(cell.shape, -jnp.inf, self.vertices.dtype)
        start = jnp.array(0, first.dtype), nothing, first
        best = jax.lax.while_loop(lambda state: state[0] <= most, look, start)[2]
        return list(self.vertices[:, best])


def read_hulls(model: mujoco.MjModel, ids: tuple[int, ...]) -> Hulls:
    """Those of some mesh geoms; geoms of one mesh share one."""
    meshes = [int(model.geom_dataid[g]) for g in ids]
    rows = {mesh: row for row, mesh in enumerate(dict.fromkeys(meshes))}
    hulls = [np.asarray(_hull(model, mesh), np.float32) for mesh in rows]
    counts, chosen = zip(*(_by_cell(hull.tobytes()) for hull in hulls), strict=True)
    sizes = np.stack([np.abs(hull).max(0) for hull in hulls], 1)[..., None]
    radii = np.stack(
        [np.linalg.norm(hull, axis=1).max(keepdims=True) for hull in hulls]
    )
    row = np.array([rows[mesh] for mesh in meshes])
    vertices = [hull[own] for hull, own in zip(hulls, chosen, strict=True)]
    return Hulls(
        row=jnp.asarray(row[:, None], jnp.int32),
        bounds=jnp.asarray(sizes[:, row]),
        radius=jnp.asarray(radii[row]),
        first=jnp.asarray(np.cumsum([0, *np.concatenate(counts)]), jnp.int32),
        vertices=jnp.asarray(np.concatenate(vertices).T),
    )


def joined(parts: Sequence[tuple[Hulls | None, int]]) -> Hulls | None:
    """Those of several parts of so many geoms each; what is no mesh gets a point's."""
    if not any(hulls for hulls, _ in parts):
        return None
    point = jnp.arange(CELLS + 1, dtype=jnp.int32)
    nothing = jnp.zeros((3, CELLS), jnp.float32)
    first, vertices = [], []
    rows, bounds, radius = [], [], []
    for hulls, count in parts:
        if hulls is None:
            zero = jnp.zeros((count, 1), jnp.float32)
            hulls = Hulls(
                zero.astype(jnp.int32),
                jnp.zeros((3, count, 1), jnp.float32),
                zero,
                point,
                nothing,
            )
        rows.append(hulls.row + sum(map(len, first)) // CELLS)
        first.append(hulls.first[:-1] + sum(x.shape[1] for x in vertices))
        vertices.append(hulls.vertices)
        bounds.append(hulls.bounds)
        radius.append(hulls.radius)
    end = jnp.array([sum(x.shape[1] for x in vertices)], jnp.int32)
    return Hulls(
        row=jnp.concatenate(rows),
        bounds=jnp.concatenate(bounds, 1),
        radius=jnp.concatenate(radius),
        first=jnp.concatenate([*first, end]),
        vertices=jnp.concatenate(vertices, 1),
    )


def _cell(along: list[jax.Array]) -> jax.Array:
    """Whose square a direction goes through."""
    size = [jnp.abs(x) for x in along]
    longest = jnp.maximum(jnp.maximum(size[0], size[1]), size[2])
    scale = GRID / 2 / jnp.maximum(longest, TINY)
    x, y, z = along

    def choose(values: list[jax.Array]) -> jax.Array:
        other = jnp.where(size[1] == longest, values[1], values[2])
        return jnp.where(size[0] == longest, values[0], other)

    def square(x: jax.Array) -> jax.Array:
        place = (x * scale + GRID / 2).astype(jnp.int32)
        return jnp.clip(place, 0, GRID - 1)

    axis = choose([jnp.full(longest.shape, k, jnp.int32) for k in range(3)])
    face = 2 * axis + (choose([x, y, z]) > 0)
    return (face * GRID + square(choose([y, z, x]))) * GRID + square(choose([z, x, y]))


@lru_cache(maxsize=256)
def _by_cell(hull: bytes) -> tuple[np.ndarray, np.ndarray]:
    """`[CELLS]` how many vertices each cell has, and which, one cell after the other."""
    vertices = np.frombuffer(hull, np.float32).reshape(-1, 3).astype(float)
    slack = ROUNDING * np.abs(vertices).max()
    grid, chosen = 1, np.tile(np.arange(len(vertices)), (6, 1))
    counts = np.full(6, len(vertices))
    while grid < GRID:  # a cell's parts have no others than it has
        grid *= 2
        face, i, j = np.indices((6, grid, grid)).reshape(3, -1)
        parent = (face * grid // 2 + i // 2) * grid // 2 + j // 2
        chosen, known = chosen[parent], counts[parent]
        here = np.arange(chosen.shape[1]) < known[:, None]
        corners = _corners(face, i, j, grid)
        heights = np.einsum("cvk,cdk->cvd", vertices[chosen], corners)
        heights[~here] = -np.inf
        kept = here
        for k in range(corners.shape[1]):
            farthest = heights[:, :, k].argmax(1)
            lower = heights < heights[np.arange(len(i)), farthest][:, None] - slack
            kept = kept & ~lower.all(-1)
        counts = kept.sum(1)
        order = np.argsort(~kept, axis=1, kind="stable")[:, : counts.max()]
        chosen = np.take_along_axis(chosen, order, 1)
    return counts, chosen[np.arange(chosen.shape[1]) < counts[:, None]]


def _corners(face: np.ndarray, i: np.ndarray, j: np.ndarray, grid: int) -> np.ndarray:
    """`[cells, 5, 3]` the corners of each cell, and its middle."""
    far = 1 / grid + BORDER
    sides = np.array([(-far, -far), (-far, far), (far, -far), (far, far), (0, 0)])
    middle = (2 * np.stack([i, j], 1) + 1) / grid - 1
    across = middle[:, None] + sides
    axis, sign = np.divmod(face, 2)
    corners = np.empty((len(face), 5, 3))
    row = np.arange(len(face))[:, None], np.arange(5)
    corners[*row, axis[:, None]] = (2 * sign - 1)[:, None]
    for k in range(2):
        corners[*row, (axis[:, None] + 1 + k) % 3] = across[..., k]
    return corners


def _hull(model: mujoco.MjModel, mesh: int) -> np.ndarray:
    """`[V, 3]` vertices of a mesh's convex hull; all of its vertices if MuJoCo made none.

    The graph is: numbers of vertices and of faces, an edge address per vertex, then each
    vertex' place in the mesh.
    """
    start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    vertices = model.mesh_vert[start : start + count]
    graph = model.mesh_graphadr[mesh]
    if graph < 0:
        return vertices
    count = model.mesh_graph[graph]
    return vertices[model.mesh_graph[graph + 2 + count : graph + 2 + 2 * count]]

"""Search trees in fixed arrays: allocated once, filled in order, never grown.

The trees of one problem share one pool of nodes; `side` says which tree a node is in.
An RRT has one tree (side 0, root 0), RRT-Connect a second one from the goal (side 1, root 1),
or from a set of goals (roots 1 to G).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.planning.space import Space

NO_PARENT = -1
BLOCK = 256
"""Nodes that a search for the nearest looks at in one go; the pool is a multiple of it."""


class Tree(NamedTuple):
    """The search trees of P problems with room for N nodes each."""

    q: jax.Array
    """`[P, d, N]` [rad]; nodes last, so that distances to all of them are one pass."""
    parent: jax.Array
    """`[P, N]` index of the parent, less than the node's own."""
    side: jax.Array
    """`[P, N]` 0 = tree of the start, 1 = tree of the goal."""
    cost: jax.Array
    """`[P, N]` length of the path to the node from the root of its tree [rad]."""
    domain: jax.Array
    """`[P, N]` samples farther away than this do not come to the node (`domain`) [rad]."""
    size: jax.Array
    """`[P]` nodes in use, both trees together; what lies behind them means nothing."""
    behind: jax.Array
    """`[P]` how many of them are in the goal's tree."""


def bare(problems: int, joints: int, capacity: int) -> Tree:
    """Pools for `capacity` nodes that hold none."""
    capacity = -(-capacity // BLOCK) * BLOCK
    nodes = jnp.zeros((problems, capacity), jnp.int32)
    q = jnp.zeros((problems, joints, capacity))
    cost = jnp.zeros((problems, capacity))
    none = jnp.zeros(problems, jnp.int32)
    return Tree(q, nodes, nodes, cost, cost, none, none)


def plant(tree: Tree, roots: jax.Array, where: jax.Array) -> Tree:
    """Trees that hold the roots `[P, R, d]` and nothing else, in the problems `where [P]`.

    The first is the start's, the others are the goal's.
    """
    sides = roots.shape[1]

    def set_(leaf: jax.Array, value: jax.Array) -> jax.Array:
        mask = where.reshape(-1, *(1,) * (leaf.ndim - 1))
        old = leaf[..., :sides]
        return leaf.at[..., :sides].set(jnp.where(mask, value, old))

    return Tree(
        q=set_(tree.q, jnp.swapaxes(roots, 1, 2)),
        parent=set_(tree.parent, jnp.full((1, sides), NO_PARENT)),
        side=set_(tree.side, jnp.minimum(jnp.arange(sides), 1)[None]),
        cost=set_(tree.cost, jnp.zeros((1, sides))),
        domain=set_(tree.domain, jnp.full((1, sides), jnp.inf)),
        size=jnp.where(where, sides, tree.size),
        behind=jnp.where(where, sides - 1, tree.behind),
    )


def nearest(
    tree: Tree,
    side: jax.Array,
    target: jax.Array,
    space: Space,
    most: jax.Array | None = None,
) -> tuple[jax.Array, jax.Array]:
    """The node of a tree that is nearest to a target, the oldest of equals.

    Args:
        tree: Search trees.
        side: `[P, K]` in which tree to look.
        target: `[P, K, d]` [rad].
        space: Of the configurations.
        most: `[P, K]` only nodes from which the target costs at most this are looked at.

    Returns:
        `[P, K]` the node, and `[P, K]` how far it is, infinite if there is none.
    """
    joints = range(target.shape[-1])

    def block(i: jax.Array, best: tuple[jax.Array, jax.Array]):
        least, index = best
        q, sides = (
            jax.lax.dynamic_slice_in_dim(leaf, i * BLOCK, BLOCK, leaf.ndim - 1)
            for leaf in (tree.q, tree.side)
        )
        gaps = [space.short(target[..., j, None] - q[:, None, j], j) for j in joints]
        used = i * BLOCK + jnp.arange(BLOCK) < tree.size[:, None, None]
        here = (sides[:, None] == side[..., None]) & used
        squares = space.squares(gaps)
        if most is not None:
            cost = jax.lax.dynamic_slice_in_dim(tree.cost, i * BLOCK, BLOCK, 1)
            here &= cost[:, None] + jnp.sqrt(squares) <= most[..., None]
        gaps = jnp.where(here, squares, jnp.inf)
        index_here, least_here = first_min(gaps)
        nearer = least_here < least
        return (
            jnp.where(nearer, least_here, least),
            jnp.where(nearer, index_here + i * BLOCK, index),
        )

    none = jnp.full(side.shape, jnp.inf), jnp.zeros(side.shape, jnp.int32)
    blocks = (jnp.max(tree.size) + BLOCK - 1) // BLOCK
    least, index = jax.lax.fori_loop(0, blocks, block, none)
    return index, jnp.sqrt(least)


def distances(
    tree: Tree, side: jax.Array, target: jax.Array, space: Space
) -> jax.Array:
    """`[P, K, N]` distance of every node to `target [P, K, d]`, infinite off tree `side [P, K]`."""
    gaps = [
        space.short(target[..., j, None] - tree.q[:, None, j], j)
        for j in range(target.shape[-1])
    ]
    gaps = jnp.sqrt(space.squares(gaps))
    used = jnp.arange(tree.side.shape[1]) < tree.size[:, None, None]
    here = (tree.side[:, None] == side[..., None]) & used
    return jnp.where(here, gaps, jnp.inf)


def first_min(values: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Index of the least of `[..., N]`, the first of equals, and the least itself.

    A third of the time of `argmin`.
    """
    # one rounding on both sides of the ==
    values = jax.lax.optimization_barrier(values)
    least = jnp.min(values, axis=-1)
    index = jnp.arange(values.shape[-1], dtype=jnp.int32)
    last = values.shape[-1] - 1
    where = jnp.where(values == least[..., None], index, last)
    return jnp.min(where, axis=-1), least


def at(rows: jax.Array, index: jax.Array) -> jax.Array:
    """`rows[p, index[p]]` for every problem p; `rows` is `[P, N, ...]`, `index [P, ...]`."""
    problem = jnp.arange(rows.shape[0]).reshape((-1,) + (1,) * (index.ndim - 1))
    return rows[problem, index]


def configurations(tree: Tree, node: jax.Array) -> jax.Array:
    """`[P, K, d]` of nodes `[P, K]`."""
    problem = jnp.arange(node.shape[0])[:, None]
    return tree.q[problem, :, node]


def insert(
    tree: Tree,
    q: jax.Array,
    parent: jax.Array,
    side: jax.Array,
    cost: jax.Array,
    slot: jax.Array,
    keep: jax.Array,
) -> Tree:
    """Writes those of `[P, K]` candidate nodes that `keep` marks into their slots."""
    index = jnp.where(keep, slot, tree.parent.shape[1])
    problem = jnp.arange(keep.shape[0])[:, None]
    return tree._replace(
        q=tree.q.at[problem, :, index].set(q, mode="drop"),
        parent=tree.parent.at[problem, index].set(parent, mode="drop"),
        side=tree.side.at[problem, index].set(side, mode="drop"),
        cost=tree.cost.at[problem, index].set(cost, mode="drop"),
        domain=tree.domain.at[problem, index].set(jnp.inf, mode="drop"),
        size=tree.size + jnp.sum(keep, axis=1, dtype=jnp.int32),
        behind=tree.behind + jnp.sum(keep & (side == 1), axis=1, dtype=jnp.int32),
    )


def sizes(tree: Tree) -> jax.Array:
    """`[P, 2]` nodes of the start's tree and of the goal's."""
    return jnp.stack([tree.size - tree.behind, tree.behind], axis=1)


def extract_path(
    tree: Tree, node: jax.Array, joint: jax.Array, waypoints: int
) -> tuple[jax.Array, jax.Array]:
    """The path from root 0 to `node`, and on from `joint` to the root of the goal's tree.

    Args:
        tree: Search trees.
        node: `[P]` a node of the start's tree, or -1 for an empty path.
        joint: `[P]` the node of the goal's tree at the same configuration, or -1 if none.
        waypoints: W, room for the path; a longer one is cut.

    Returns:
        `path [P, W, d]` with the last point repeated, and `path_length [P]`, uncut.
    """
    there, n_there = _lineage(tree, node, waypoints)
    onward, n_onward = _lineage(tree, joint, waypoints)
    length = n_there + jnp.maximum(n_onward - 1, 0)
    step = jnp.arange(waypoints, dtype=jnp.int32)
    step = jnp.minimum(step, jnp.maximum(length - 1, 0)[:, None])
    back = n_there[:, None] - 1 - step  # there[] runs from the node to the root
    index = jnp.where(
        back >= 0,
        at(there, jnp.clip(back, 0, waypoints - 1)),
        at(onward, jnp.clip(-back, 0, waypoints - 1)),
    )
    return configurations(tree, index), length


def _lineage(tree: Tree, node: jax.Array, room: int) -> tuple[jax.Array, jax.Array]:
    """Indices `[P, room]` from `node [P]` up to its root, and how many; none for node < 0."""

    def climb(carry):
        depth, node, line, length = carry
        line = line.at[:, depth].set(jnp.maximum(node, 0), mode="drop")
        length = length + (node >= 0)
        parent = at(tree.parent, jnp.maximum(node, 0))
        return depth + 1, jnp.where(node >= 0, parent, NO_PARENT), line, length

    line = jnp.zeros((len(node), room), jnp.int32)
    length = jnp.zeros_like(node)
    carry = (jnp.int32(0), node, line, length)
    _, _, line, length = jax.lax.while_loop(lambda c: jnp.any(c[1] >= 0), climb, carry)
    return line, length

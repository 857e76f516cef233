"""Search trees in fixed arrays: allocated once, filled in order, never grown.

The trees of one problem share one pool of nodes; `side` says which tree a node is in.
An RRT has one tree (side 0, root 0), RRT-Connect a second one from the goal (side 1, root 1).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

NO_PARENT = -1
EMPTY = -1
"""The `side` of a slot that holds no node."""


class Tree(NamedTuple):
    """The search trees of P problems with room for N nodes each."""

    q: jax.Array
    """`[P, N, d]` [rad]."""
    parent: jax.Array
    """`[P, N]` index of the parent, less than the node's own."""
    side: jax.Array
    """`[P, N]` 0 = tree of the start, 1 = tree of the goal, -1 = empty."""
    size: jax.Array
    """`[P]` nodes in use, both trees together."""


def plant(roots: jax.Array, capacity: int) -> Tree:
    """A pool of `capacity` nodes that holds the roots `[P, sides, d]` and nothing else."""
    problems, sides, joints = roots.shape
    tree = Tree(
        q=jnp.zeros((problems, capacity, joints), roots.dtype),
        parent=jnp.full((problems, capacity), NO_PARENT, jnp.int32),
        side=jnp.full((problems, capacity), EMPTY, jnp.int32),
        size=jnp.full((problems,), sides, jnp.int32),
    )
    side = jnp.arange(sides, dtype=jnp.int32)
    return tree._replace(
        q=tree.q.at[:, :sides].set(roots), side=tree.side.at[:, :sides].set(side)
    )


def distance(
    q0: jax.Array, q1: jax.Array, metric: tuple[float, ...] | None
) -> jax.Array:
    """d(q, q') = |W (q - q')| over the last axis, `metric` being W's diagonal."""
    gap = q0 - q1
    if metric is not None:
        gap = gap * jnp.asarray(metric, gap.dtype)
    # joint by joint: XLA CPU does not vectorise a sum over so short a last axis
    return jnp.sqrt(sum(gap[..., j] ** 2 for j in range(gap.shape[-1])))


def distances(
    tree: Tree, side: jax.Array, target: jax.Array, metric: tuple[float, ...] | None
) -> jax.Array:
    """`[P, N]` distance of every node to `target [P, d]`, infinite off tree `side [P]`."""
    gaps = distance(tree.q, target[:, None], metric)
    return jnp.where(tree.side == side[:, None], gaps, jnp.inf)


def first_min(values: jax.Array) -> jax.Array:
    """`[P]` index of the least of `[P, N]`, the first of equals; argmin in 1/3 of its time."""
    values = jax.lax.optimization_barrier(
        values
    )  # one rounding on both sides of the ==
    least = jnp.min(values, axis=-1, keepdims=True)
    index = jnp.arange(values.shape[-1], dtype=jnp.int32)
    return jnp.min(jnp.where(values == least, index, values.shape[-1] - 1), axis=-1)


def nearest(
    tree: Tree, side: jax.Array, target: jax.Array, metric: tuple[float, ...] | None
) -> jax.Array:
    """`[P]` index of the node of tree `side` nearest to `target`, the oldest of equals."""
    return first_min(distances(tree, side, target, metric))


def at(rows: jax.Array, index: jax.Array) -> jax.Array:
    """`rows[p, index[p]]` for every problem p; `rows` is `[P, N, ...]`, `index [P, ...]`."""
    problem = jnp.arange(rows.shape[0]).reshape((-1,) + (1,) * (index.ndim - 1))
    return rows[problem, index]


def insert(
    tree: Tree, q: jax.Array, parent: jax.Array, side: jax.Array, keep: jax.Array
) -> Tree:
    """Appends in order those of `[K, P, ...]` candidate nodes that `keep [K, P]` marks."""
    rank = jnp.cumsum(keep, axis=0, dtype=jnp.int32)
    index = jnp.where(keep, tree.size + rank - 1, tree.q.shape[1])
    problem = jnp.arange(keep.shape[1])
    return Tree(
        q=tree.q.at[problem, index].set(q, mode="drop"),
        parent=tree.parent.at[problem, index].set(parent, mode="drop"),
        side=tree.side.at[problem, index].set(side, mode="drop"),
        size=tree.size + rank[-1],
    )


def _lineage(tree: Tree, node: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Indices `[P, N]` from `node [P]` up to its root, and how many; none for node < 0."""

    def climb(carry):
        depth, node, line, length = carry
        line = line.at[:, depth].set(jnp.maximum(node, 0))
        length = length + (node >= 0)
        parent = at(tree.parent, jnp.maximum(node, 0))
        return depth + 1, jnp.where(node >= 0, parent, NO_PARENT), line, length

    line, length = jnp.zeros_like(tree.parent), jnp.zeros_like(node)
    carry = (jnp.int32(0), node, line, length)
    _, _, line, length = jax.lax.while_loop(lambda c: jnp.any(c[1] >= 0), climb, carry)
    return line, length


def extract_path(
    tree: Tree, node: jax.Array, joint: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """The path from root 0 to `node`, and on from `joint` to the root of the goal's tree.

    Args:
        tree: Search trees.
        node: `[P]` a node of the start's tree, or -1 for an empty path.
        joint: `[P]` the node of the goal's tree at the same configuration, or -1 if none.

    Returns:
        `path [P, N, d]` with the last point repeated, and `path_length [P]`.
    """
    there, n_there = _lineage(tree, node)
    onward, n_onward = _lineage(tree, joint)
    length = n_there + jnp.maximum(n_onward - 1, 0)
    step = jnp.arange(tree.q.shape[1], dtype=jnp.int32)
    step = jnp.minimum(step, jnp.maximum(length - 1, 0)[:, None])
    back = n_there[:, None] - 1 - step  # there[] runs from the node to the root
    index = jnp.where(
        back >= 0,
        at(there, jnp.maximum(back, 0)),
        at(onward, jnp.clip(-back, 0, tree.q.shape[1] - 1)),
    )
    return at(tree.q, index), length

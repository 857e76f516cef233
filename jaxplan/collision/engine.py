"""The fast backend: kinematics and narrow phase of a flat batch, in blocks.

Written for XLA on CPU: batch last, a block small enough for the cache, a running
minimum instead of boolean reductions (performance: 10x over the plain form).
"""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.convex import least_convex
from jaxplan.collision.fronts import (
    Front,
    find_convex_pairs,
    find_fronts,
)
from jaxplan.collision.kinematics import link_poses, rotation_of
from jaxplan.collision.margins import Rule, required
from jaxplan.collision.narrow import CLOSED
from jaxplan.collision.reach import (
    Extent,
    Ways,
    extents,
    find_ways,
    moved_by,
    travel_from,
)
from jaxplan.collision.shapes import (
    Score,
    Shapes,
    in_world,
    read,
    seen_from,
    smaller,
)
from jaxplan.collision.world import World
from jaxplan.scene import Scene

XLA_OPTIONS: dict[str, str | bool] = (
    {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__ < (0, 11) else {}
)
"""Compiler options for the outermost `jax.jit` of anything that checks collisions: with
XLA's CPU fusion emitters, kinematic chains are recomputed for every use (100x slower).
Later versions of XLA refuse the option."""

BLOCK = 256


def least_scores(
    scene: Scene,
    world: World,
    q: jax.Array,
    score: Score,
    motion: jax.Array | None = None,
) -> jax.Array:
    """Least score over all pairs that count.

    Args:
        scene: The scene.
        world: Leaves with the batch last, `[..., N]` or `[..., 1]`.
        q: `[d, N]` joints.
        score: What is rated.
        motion: `[d, N]` each joint may be this far from q [rad or m]; what the geoms of a
            pair may come closer by is part of the pair's margin.

    Returns:
        `[N]`.
    """
    if not scene.groups:
        return jnp.full(q.shape[-1], jnp.inf, q.dtype)
    fronts, pairs = find_fronts(scene), find_convex_pairs(scene)
    slots = {slot.geom: index for index, slot in enumerate(scene.slots)}

    def shapes(ids: tuple[int, ...], world: World) -> Shapes:
        if ids[0] in slots:
            return _in_slots(world, [slots[geom] for geom in ids])
        return read(scene, ids, world)

    def scores(front: Front, poses: jax.Array, world: World, score: Score) -> jax.Array:
        own = in_world(shapes(front.facing, world), poses, np.array(front.links))
        function = CLOSED[front.kinds]
        if front.obstacles[0].ids[0] in slots:
            rows = [slots[geom] for o in front.obstacles for geom in o.ids]
            return _least_over_slots(function, own, world, rows, score)
        frame = poses[scene.structure.link_of[front.obstacles[0].body]]
        near = seen_from(own, frame)
        rated, first = [], 0
        for o in front.obstacles:
            own = score.among(first, len(o.ids))
            rated.append(function(near, shapes(o.ids, world), own))
            first += len(o.ids)
        return reduce(smaller, rated)

    def convex(
        poses: jax.Array, world: World, counts: jax.Array, score: Score
    ) -> jax.Array:
        parts, row = [], {}
        for (kind, moves), ids in pairs.geoms.items():
            own = shapes(ids, world)
            if not moves:
                links = [
                    scene.structure.link_of[scene.mj_model.geom_bodyid[g]] for g in ids
                ]
                own = in_world(own, poses, np.array(links))
            row |= {geom: len(row) + i for i, geom in enumerate(ids)}
            parts.append((kind, own))
        rows = np.array([[row[a], row[b]] for a, b in pairs.pairs])
        return least_convex(parts, rows, counts[np.array(pairs.groups)], score)

    def block(
        q: jax.Array, world: World, motion: jax.Array | None, extent: Extent | None
    ) -> jax.Array:
        poses = link_poses(scene, world, q)
        counts = counting(scene, world)
        travel = None
        if motion is not None:
            travel = travel_from(scene, world, ways, poses, q, motion)

        def nearer(
            groups: Sequence[int], *sides: Sequence[Sequence[int]]
        ) -> jax.Array | float:
            if travel is None or extent is None:
                return 0.0
            return sum(
                moved_by(travel, ways.of_geoms(scene, groups, side), extent.of(side))
                for side in sides
            )

        least = []
        for front in fronts:
            obstacles = [geom for o in front.obstacles for geom in o.ids]
            facing = [(geom,) for geom in front.facing]
            closer = nearer(front.groups, facing, [obstacles])
            margins = _margins(front.rules, score, closer)
            rated = scores(front, poses, world, score._replace(margin=margins))
            rated = jnp.where(counts[np.array(front.groups)], rated, jnp.inf)
            least.append(jnp.min(rated, 0))
        if pairs.pairs:
            sides = (
                [(geom,) for geom in side] for side in zip(*pairs.pairs, strict=True)
            )
            closer = nearer(pairs.groups, *sides)
            (margins,) = _margins([pairs.rules], score, closer)
            rated = score._replace(margin=margins)
            least.append(convex(poses, world, counts, rated))
        return reduce(smaller, least)

    ways, extent = Ways((), {}), None
    if motion is not None:
        width = max(leaf.shape[-1] for leaf in world)
        anywhere = jnp.zeros((len(q), width), q.dtype)
        ways = find_ways(scene)
        poses = link_poses(scene, world, anywhere)
        extent = extents(scene, world, ways, poses)
    return _in_blocks(block, q, world, motion, extent)


def _margins(
    rules: Sequence[Sequence[Rule]], score: Score, closer: jax.Array | float
) -> list[jax.Array | float]:
    """`[n, B]`, `[n, 1]` or a number [m], by obstacle: what its pairs ask for and move."""
    if score.exact:
        return [score.margin + closer for _ in rules]
    return [required(own, score.margin) + closer for own in rules]


def _in_slots(world: World, rows: list[int]) -> Shapes:
    """The obstacles in some slots, in the world's frame; leaves `[n, B]`."""
    pose, size = world.slot_pose[np.array(rows)], world.slot_size[np.array(rows)]
    turn = rotation_of(jnp.moveaxis(pose[:, 3:], 1, 0))
    return Shapes(
        [pose[:, k] for k in range(3)],
        [[turn[i, k] for i in range(3)] for k in range(3)],
        [size[:, k] for k in range(3)],
    )


def _least_over_slots(
    function: Callable, own: Shapes, world: World, rows: list[int], score: Score
) -> jax.Array:
    """Least score `[n, B]` over slots of one kind, each seen from its own frame."""
    still = jnp.zeros((1, 1), own.centre[0].dtype)
    axes = [[still + (i == k) for i in range(3)] for k in range(3)]
    rated = []
    # Written out: in a loop, XLA on CPU takes three times as long.
    for j, row in enumerate(rows):
        pose, size = world.slot_pose[row], world.slot_size[row]
        if pose.shape[-1] == 1:  # numbers are faster than rows of one
            pose, size = pose[:, 0], size[:, 0]
        frame = jnp.concatenate([rotation_of(pose[3:]), pose[:3, None]], 1)
        near = seen_from(own, frame)
        size = [jnp.atleast_2d(size[k]) for k in range(3)]
        rated.append(function(near, Shapes([still] * 3, axes, size), score.among(j, 1)))
    return reduce(smaller, rated)


def counting(scene: Scene, world: World) -> jax.Array:
    """`[n_groups, B]` whether each contact group counts."""
    needs = np.array([bool(group.held) for group in scene.groups])
    held = [jnp.any(world.held[np.array(group.held, int)], 0) for group in scene.groups]
    return ~world.ignored & (jnp.stack(held) | ~needs[:, None])


def _in_blocks(function: Callable[..., jax.Array], *batch: Any) -> jax.Array:
    """`function(*batch)` on blocks of the batch, one after the other on a CPU.

    Args:
        function: Gives `[B]`.
        batch: Trees of arrays `[..., N]`, or `[..., 1]` where the whole batch shares one.
    """
    leaves, tree = jax.tree.flatten(batch)
    rows = max(leaf.shape[-1] for leaf in leaves)
    blocks = -(-rows // BLOCK)
    if blocks == 1 or jax.default_backend() != "cpu":
        return function(*batch)
    width = -(-rows // blocks)

    def split(leaf: jax.Array) -> Any:  # None: the whole batch shares it
        if leaf.shape[-1] == 1:
            return None
        padding = [(0, 0)] * (leaf.ndim - 1) + [(0, blocks * width - rows)]
        padded = jnp.pad(leaf, padding, mode="edge")
        return jnp.moveaxis(padded.reshape(*leaf.shape[:-1], blocks, width), -2, 0)

    def one(parts: list[Any]) -> jax.Array:
        pairs = zip(parts, leaves, strict=True)
        return function(*tree.unflatten(b if a is None else a for a, b in pairs))

    return jax.lax.map(one, [*map(split, leaves)]).reshape(-1)[:rows]

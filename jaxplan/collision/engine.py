"""The fast backend: kinematics and narrow phase of a flat batch, in blocks.

Written for XLA on CPU: batch last, a block small enough for the cache, a running
minimum instead of boolean reductions (performance: 10x over the plain form).
"""

from collections import defaultdict
from functools import reduce
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.collision.kinematics import Pose, body_poses
from jaxplan.collision.narrow import (
    FUNCTIONS,
    Score,
    Shapes,
    join,
    place,
    place_back,
    read,
)
from jaxplan.collision.world import World
from jaxplan.scene import Geoms, Scene

XLA_OPTIONS = {"xla_cpu_use_fusion_emitters": False}
"""Compiler options for the outermost `jax.jit` of anything that checks collisions: with
XLA's CPU fusion emitters, kinematic chains are recomputed for every use (100x slower)."""

BLOCK = 256


class Front(NamedTuple):
    """Geoms of several bodies that face the same obstacles."""

    facing: tuple[Geoms, ...]
    groups: tuple[int, ...]
    """Contact group of each."""
    obstacles: tuple[Geoms, ...]


def missing_kinds(scene: Scene) -> set[tuple[str, str]]:
    """Pairs of geom kinds in the scene that this backend lacks."""
    kinds = {(c.a.kind, c.b.kind) for g in scene.groups for c in g.contacts}
    return kinds - set(FUNCTIONS)


def least_scores(scene: Scene, world: World, q: jax.Array, score: Score) -> jax.Array:
    """Least score over all pairs that count.

    Args:
        scene: The scene.
        world: Leaves with the batch last, `[..., N]` or `[..., 1]`.
        q: `[d, N]` joints.
        score: What is rated.

    Returns:
        `[N]`.
    """
    fronts = _fronts(scene)
    sets = {g for front in fronts for g in (*front.facing, *front.obstacles)}
    shapes = {geoms: read(scene, geoms) for geoms in sets}

    def block(q: jax.Array, world: World) -> jax.Array:
        poses = body_poses(scene, world, q)
        placed = {geoms: place(shapes[geoms], poses[geoms.body]) for geoms in sets}
        rated = jnp.full(q.shape[-1], jnp.inf)
        counts = _counts(scene, world)
        for front in fronts:
            scores = _front_scores(front, shapes, placed, poses, score)
            start = 0
            for geoms, group in zip(front.facing, front.groups, strict=True):
                end = start + len(geoms.ids)
                least = jnp.min(scores[start:end], 0)
                rated = jnp.minimum(rated, jnp.where(counts[group], least, jnp.inf))
                start = end
        return rated

    return _in_blocks(block, q, world)


def _fronts(scene: Scene) -> list[Front]:
    """Contacts, put together by obstacle and then by who faces it."""
    facing = defaultdict(list)
    for index, group in enumerate(scene.groups):
        for contact in group.contacts:
            facing[contact.b, contact.a.kind].append((contact.a, index))
    fronts = defaultdict(list)
    for (obstacles, _), sides in facing.items():
        key = tuple(sides), obstacles.kind, obstacles.body
        fronts[key].append(obstacles)
    return [
        Front(tuple(a for a, _ in sides), tuple(g for _, g in sides), tuple(obstacles))
        for (sides, _, _), obstacles in fronts.items()
    ]


def _front_scores(
    front: Front,
    shapes: dict[Geoms, Shapes],
    placed: dict[Geoms, Shapes],
    poses: dict[int, Pose],
    score: Score,
) -> jax.Array:
    """Least score of each facing geom, `[n, B]`."""
    first = front.obstacles[0]
    function = FUNCTIONS[front.facing[0].kind, first.kind]
    facing = join([placed[geoms] for geoms in front.facing])
    where = placed
    if first.kind == "box":
        facing, where = place_back(facing, poses[first.body]), shapes
    facing = Shapes(*jax.lax.optimization_barrier(tuple(facing)))
    return reduce(
        jnp.minimum, [function(facing, where[o], score) for o in front.obstacles]
    )


def _counts(scene: Scene, world: World) -> list[jax.Array]:
    """Whether each contact group counts, `[B]` bool each."""
    counts = []
    for index, group in enumerate(scene.groups):
        count = ~world.ignored[index]
        if group.held:
            count &= reduce(jnp.logical_or, [world.held[o] for o in group.held])
        counts.append(count)
    return counts


def _in_blocks(function, q: jax.Array, world: World) -> jax.Array:
    """`function(q, world)` on blocks of the batch, one after the other on a CPU."""
    rows = q.shape[-1]
    blocks = -(-rows // BLOCK)
    if blocks == 1 or jax.default_backend() != "cpu":
        return function(q, world)
    width = -(-rows // blocks)

    def split(leaf: jax.Array) -> jax.Array | None:
        if leaf.shape[-1] == 1:
            return None
        padding = [(0, 0)] * (leaf.ndim - 1) + [(0, blocks * width - rows)]
        padded = jnp.pad(leaf, padding, mode="edge")
        return jnp.moveaxis(padded.reshape(*leaf.shape[:-1], blocks, width), -2, 0)

    def one(parts: tuple[jax.Array, World]) -> jax.Array:
        q, own = parts
        pairs = zip(own, world, strict=True)
        return function(q, World(*(b if a is None else a for a, b in pairs)))

    parts = split(q), World(*map(split, world))
    return jax.lax.map(one, parts).reshape(-1)[:rows]

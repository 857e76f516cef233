"""The fast backend: kinematics and narrow phase of a flat batch, in blocks.

Written for XLA on CPU: batch last, a block small enough for the cache, a running
minimum instead of boolean reductions (performance: 10x over the plain form).
"""

from collections import defaultdict
from collections.abc import Callable
from functools import reduce
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.kinematics import link_poses
from jaxplan.collision.narrow import FUNCTIONS, Score, read, relative, smaller
from jaxplan.collision.world import World
from jaxplan.scene import Geoms, Scene

XLA_OPTIONS: dict[str, str | bool] = {"xla_cpu_use_fusion_emitters": False}
"""Compiler options for the outermost `jax.jit` of anything that checks collisions: with
XLA's CPU fusion emitters, kinematic chains are recomputed for every use (100x slower)."""

BLOCK = 256


class Front(NamedTuple):
    """Geoms of several bodies that face the same obstacles, all of one body."""

    facing: tuple[int, ...]
    """Geom ids."""
    links: tuple[int, ...]
    """Kinematic link of each."""
    groups: tuple[int, ...]
    """Contact group of each."""
    obstacles: tuple[Geoms, ...]
    kinds: tuple[str, str]


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
    link_of = scene.structure.link_of
    facing = [read(scene, front.facing) for front in fronts]
    obstacles = [[read(scene, o.ids) for o in front.obstacles] for front in fronts]

    def block(q: jax.Array, world: World) -> jax.Array:
        poses = link_poses(scene, world, q)
        counts = _counts(scene, world)
        least = []
        for front, own, against in zip(fronts, facing, obstacles, strict=True):
            frame = poses[link_of[front.obstacles[0].body]]
            near = relative(own, poses, np.array(front.links), frame)
            function = FUNCTIONS[front.kinds]
            scores = reduce(smaller, [function(near, b, score) for b in against])
            scores = jnp.where(counts[np.array(front.groups)], scores, jnp.inf)
            least.append(jnp.min(scores, 0))
        return reduce(smaller, least)

    return _in_blocks(block, q, world)


def _fronts(scene: Scene) -> list[Front]:
    """Contacts, put together by obstacle and then by who faces it."""
    facing = defaultdict(list)
    for index, group in enumerate(scene.groups):
        for contact in group.contacts:
            facing[contact.b, contact.a.kind].append((contact.a, index))
    together = defaultdict(list)
    for (obstacle, kind), sides in facing.items():
        key = tuple(sides), obstacle.body, (kind, obstacle.kind)
        together[key].append(obstacle)
    fronts = []
    for (sides, _, kinds), obstacles in together.items():
        rows = [(g, s.body, index) for s, index in sides for g in s.ids]
        geoms, bodies, groups = zip(*rows, strict=True)
        links = tuple(scene.structure.link_of[body] for body in bodies)
        fronts.append(Front(geoms, links, groups, tuple(obstacles), kinds))
    return fronts


def _counts(scene: Scene, world: World) -> jax.Array:
    """`[n_groups, B]` whether each contact group counts."""
    needs = np.array([bool(group.held) for group in scene.groups])
    held = [jnp.any(world.held[np.array(group.held, int)], 0) for group in scene.groups]
    return ~world.ignored & (jnp.stack(held) | ~needs[:, None])


def _in_blocks(
    function: Callable[[jax.Array, World], jax.Array], q: jax.Array, world: World
) -> jax.Array:
    """`function(q, world)` on blocks of the batch, one after the other on a CPU."""
    rows = q.shape[-1]
    blocks = -(-rows // BLOCK)
    if blocks == 1 or jax.default_backend() != "cpu":
        return function(q, world)
    width = -(-rows // blocks)

    def split(leaf: jax.Array) -> Any:  # None: the whole batch shares it
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

"""How far geoms move at most while every joint stays near its place.

A hinge that turns by t moves a point by at most t times its distance from the axis, a
slide by what it slides. Of a contact's two geoms only the joints between them count, those
that move one and not the other. Taken from a geom upwards, each of these joints adds

    D <- D + t (rho + D)    for a hinge,    D <- D + t    for a slide

where rho is the distance from the joint's axis to a point that moves with the geom: the
anchor of the first of these joints. As to what the geom has beyond that point, the first
joint turns it about its own axis, and the others by all their angles together.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.kinematics import joints_moved
from jaxplan.collision.shapes import (
    Shapes,
    Vector,
    cross,
    dot,
    in_world,
    minus,
    once,
    read,
    total,
)
from jaxplan.collision.world import World
from jaxplan.scene import Scene
from jaxplan.scene.dependent import spread


class Way(NamedTuple):
    """The joints that move one side of a contact and not the other."""

    links: tuple[int, ...]
    """Rows of the links that they move, from the geom up."""
    held: tuple[tuple[int, bool], ...]
    """So it is where these objects are held, or are not."""


class Ways(NamedTuple):
    """Those of all contacts of a scene."""

    ways: tuple[Way, ...]
    """The first has no joints."""
    of_side: dict[tuple[int, int], tuple[int, ...]]
    """By contact group and body: which of the ways may be that of the body's geoms."""

    def of_geoms(
        self, scene: Scene, groups: Sequence[int], side: Sequence[Sequence[int]]
    ) -> list[tuple[int, ...]]:
        """By contact group `[n]`, those of some geoms of one body, `[n]` or `[1]`."""
        sides = side if len(side) == len(groups) else len(groups) * [*side]
        bodies = [int(scene.mj_model.geom_bodyid[geoms[0]]) for geoms in sides]
        return [self.of_side[key] for key in zip(groups, bodies, strict=True)]

    def order(self) -> np.ndarray:
        """`[n_ways, longest]` their links, filled up with 0: the world, which stands still."""
        longest = max(len(way.links) for way in self.ways)
        rows = [(*way.links, *(longest - len(way.links)) * (0,)) for way in self.ways]
        return np.array(rows, int).reshape(len(rows), longest)

    def so(self, world: World) -> jax.Array:
        """`[n_ways, B]` whether what each supposes to be held is, and nothing else."""
        always = jnp.ones(world.held.shape[-1], bool)
        flags = [
            [always, *(world.held[thing] == held for thing, held in way.held)]
            for way in self.ways
        ]
        return jnp.stack([jnp.all(jnp.stack(own), 0) for own in flags])


class Extent(NamedTuple):
    """How far geoms go beyond the first joint above them; leaves `[n, B]` or `[n, 1]`."""

    across: jax.Array
    """At most this from its axis [m]."""
    beyond: jax.Array
    """At most this from its anchor [m]."""

    def of(self, side: Sequence[Sequence[int]]) -> "Extent":
        """The greatest of some geoms each."""
        if all(len(geoms) == 1 for geoms in side):
            return Extent(*(leaf[np.concatenate(side)] for leaf in self))
        rows = [np.array(geoms) for geoms in side]
        return Extent(*(jnp.stack([leaf[g].max(0) for g in rows]) for leaf in self))


def link_rates(scene: Scene) -> np.ndarray:
    """`[1 + n_links, d]` how far the links' joints move by each of the arm's."""
    rates = np.concatenate([scene.rates, np.zeros((1, len(scene.joints)))])
    return rates[[-1, *(link.variable for link in scene.structure.links)]]


def link_slides(scene: Scene) -> np.ndarray:
    """`[1 + n_links]` bool."""
    return np.array([False, *(link.slides for link in scene.structure.links)])


def find_ways(scene: Scene) -> Ways:
    """Which joints count for each side of each contact."""
    order: dict[Way, int] = {Way((), ()): 0}
    moves = np.any(link_rates(scene), 1)
    of_side = {}
    for index, group in enumerate(scene.groups):
        bodies = [side.body for side in group.contacts[0]]
        found: dict[int, dict[int, None]] = {body: {} for body in bodies}
        for one, other in product(*(_lines(scene, moves, body) for body in bodies)):
            held = {*one.held, *other.held}
            if len(dict(held)) < len(held):
                continue  # one object cannot be both
            for body, own, its in zip(bodies, (one, other), (other, one), strict=True):
                apart = tuple(row for row in own.links if row not in its.links)
                if apart:
                    way = Way(apart, tuple(sorted(held)))
                    found[body][order.setdefault(way, len(order))] = None
        of_side |= {(index, body): tuple(rows) for body, rows in found.items()}
    return Ways(tuple(order), of_side)


def _lines(scene: Scene, moves: np.ndarray, body: int) -> list[Way]:
    """All that the arm moves above a body; one for each: its object in the hand or not."""
    structure = scene.structure
    own, thing = _line(scene, moves, structure.link_of[body])
    hand = structure.link_of[scene.body_id(scene.hand)]
    carrier, base = _line(scene, moves, hand)
    if thing in (-1, base) or scene.objects[thing] in scene.mocap:
        return [Way(own, ())]
    return [Way(own, ((thing, False),)), Way((*own, *carrier), ((thing, True),))]


def _line(scene: Scene, moves: np.ndarray, row: int) -> tuple[tuple[int, ...], int]:
    """Links above, a link included, whose joint the arm moves; the object above, or -1."""
    rows, thing = [], -1
    while row:
        link = scene.structure.links[row - 1]
        if moves[row]:
            rows.append(row)
        row, thing = link.parent, max(thing, link.object)
    return tuple(rows), thing


def extents(scene: Scene, world: World, ways: Ways, poses: jax.Array) -> Extent:
    """Of all geoms by id; of those that the arm never moves 0.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        ways: `find_ways`.
        poses: `[1 + n_links, 3, 4, B]` of the links, wherever the arm is.
    """
    model, links = scene.mj_model, scene.structure.link_of
    anchor, axis = joint_axes(scene, poses)
    first = {
        body: ways.ways[row].links[0]
        for (_, body), rows in ways.of_side.items()
        for row in rows
    }
    kinds: dict[str, dict[int, None]] = {}
    for group in scene.groups:
        for side in (side for contact in group.contacts for side in contact):
            if side.body in first:
                kinds.setdefault(side.kind, {}).update(dict.fromkeys(side.ids))
    across = beyond = jnp.zeros((model.ngeom, poses.shape[-1]), poses.dtype)
    for kind, geoms in kinds.items():
        ids = np.array([*geoms])
        own, bodies = read(scene, tuple(geoms), world), model.geom_bodyid[ids]
        placed = in_world(own, poses, np.array([links[int(body)] for body in bodies]))
        rows = np.array([first[int(body)] for body in bodies])
        offset = minus(placed.centre, coordinates(anchor[rows]))
        radius = core_radius(kind, own)
        off_axis = norm(cross(offset, coordinates(axis[rows])))
        across = across.at[ids].set(off_axis + radius)
        beyond = beyond.at[ids].set(norm(offset) + radius)
    return Extent(across, beyond)


def core_radius(kind: str, shapes: Shapes) -> jax.Array:
    """`[n, 1]` of a ball around the geom's core, which is all that turning moves [m].

    What is round around the core, the radius of a sphere or a capsule, goes with it.
    """
    size, corner = shapes.size, norm(shapes.size)
    if shapes.hulls:
        return shapes.hulls.radius
    return {
        "sphere": jnp.zeros_like(corner),
        "capsule": size[1],
        "cylinder": jnp.sqrt(size[0] * size[0] + size[1] * size[1]),
        "ellipsoid": jnp.maximum(jnp.maximum(size[0], size[1]), size[2]),
    }.get(kind, corner)


def joint_axes(scene: Scene, poses: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A point and the direction of each link's joint in the world, `[1 + n_links, 3, B]`."""
    joints = np.array([0, *(link.joint for link in scene.structure.links)])
    point, along = (
        getattr(scene.model, field)[joints][..., None]
        for field in ("jnt_pos", "jnt_axis")
    )

    def turned(vectors: jax.Array) -> jax.Array:
        return total(poses[:, :, k] * vectors[:, k, None] for k in range(3))

    return turned(point) + poses[:, :, 3], turned(along)


def coordinates(vectors: jax.Array) -> Vector:
    """`[n, 3, B]` taken apart."""
    return [vectors[:, k] for k in range(3)]


def norm(vector: Vector) -> jax.Array:
    """Its length."""
    return jnp.sqrt(dot(vector, vector))


def travel_from(
    scene: Scene,
    world: World,
    ways: Ways,
    poses: jax.Array,
    q: jax.Array,
    motion: jax.Array,
) -> jax.Array:
    """How far each way moves what stands at its end, from the configuration at hand.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        ways: `find_ways`.
        poses: `[1 + n_links, 3, 4, B]` where the links are.
        q: `[d, B]` the configuration [rad or m].
        motion: `[d, B]` how far each joint moves at most [rad or m].

    Returns:
        `[n_ways, 3, B]` at most: the angle of the first joint [rad], the path of its anchor
        [m], and the angles of the other joints together [rad]. Zero for a way that is not so.
    """
    anchor, axis = joint_axes(scene, poses)
    moved = _link_spans(scene, world, q, jnp.abs(motion))
    slides, order = link_slides(scene)[:, None], ways.order()
    first = order[:, :1].ravel()
    twist = jnp.where(slides[first], 0, moved[first])
    path = turn = jnp.zeros_like(twist)
    for step, rows in enumerate(order.T):
        offset = coordinates(anchor[first] - anchor[rows])
        far = norm(cross(offset, coordinates(axis[rows])))
        path = path + moved[rows] * jnp.where(slides[rows], 1, far + path)
        if step:
            turn = turn + jnp.where(slides[rows], 0, moved[rows])
    travel = jnp.stack(jnp.broadcast_arrays(twist, path, turn), 1)
    if any(way.held for way in ways.ways):
        travel = jnp.where(ways.so(world)[:, None], travel, 0)
    return once(travel)  # or it would be computed again for each geom


def _link_spans(
    scene: Scene, world: World, q: jax.Array, motion: jax.Array
) -> jax.Array:
    """`[1 + n_links, B]` how far the links' joints get from where they are at most."""
    links, dependent = scene.structure.links, scene.structure.dependent
    still = jnp.zeros((len(scene.passive), motion.shape[-1]), motion.dtype)
    spans = [*motion, *still]
    if dependent:
        spans = spread(dependent, list(joints_moved(scene, world, q)), spans)
    nothing = jnp.zeros((1, motion.shape[-1]), motion.dtype)
    spans = jnp.concatenate([jnp.stack(spans), nothing])
    return spans[np.array([-1, *(link.variable for link in links)])]


def moved_by(
    travel: jax.Array, sides: Sequence[tuple[int, ...]], extent: Extent
) -> jax.Array | float:
    """`[n, B]` how far geoms move at most [m].

    Args:
        travel: `travel_from`.
        sides: `[n]` of `Ways.of_side`.
        extent: Of the geoms; leaves `[n, B]` or `[1, B]`.
    """
    longest = max(map(len, sides))
    table = np.array([(*side, *(longest - len(side)) * (0,)) for side in sides], int)
    moved = 0.0
    for rows in table.reshape(len(sides), longest).T:
        # One gather: XLA vectorises what reads one array, not what reads three.
        own = travel[rows]
        moved += own[:, 0] * extent.across + own[:, 1] + own[:, 2] * extent.beyond
    return moved

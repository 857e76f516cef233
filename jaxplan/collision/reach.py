"""How far geoms move while every joint stays near its place: bounds, never too small.

A hinge that turns by t moves a point by at most t times its distance from the axis, a
slide by what it slides. Of a contact's two geoms only the joints between them count, those
that move one and not the other. Taken from a geom upwards, each of these joints adds

    D <- D + t (rho + D)    for a hinge,    D <- D + t    for a slide

where rho is how far it is from the joint's axis to a point that moves with the geom: the
anchor of the first of these joints. What the geom itself has beyond that point, the first
joint turns about its own axis, and the others by their angles together.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.kinematics import link_poses
from jaxplan.collision.shapes import (
    Shapes,
    Vector,
    cross,
    dot,
    in_world,
    minus,
    once,
    read,
)
from jaxplan.collision.world import World
from jaxplan.scene import Scene


class Way(NamedTuple):
    """The joints that move one side of a contact and not the other."""

    links: tuple[int, ...]
    """Rows of the links that they move, from the geom up."""
    held: tuple[tuple[int, bool], ...]
    """So it is where these objects are held or are not."""


class Ways(NamedTuple):
    """Those of all contact groups of a scene."""

    ways: tuple[Way, ...]
    """The first has no joints."""
    of_side: dict[tuple[int, int], tuple[int, ...]]
    """By group and body: which of the ways may be that of the body's geoms."""

    def of_geoms(
        self, scene: Scene, groups: Sequence[int], side: Sequence[Sequence[int]]
    ) -> list[tuple[int, ...]]:
        """Those of each geom, or of each of some geoms of one body, by contact group."""
        sides = side if len(side) == len(groups) else len(groups) * [*side]
        bodies = [int(scene.mj_model.geom_bodyid[geoms[0]]) for geoms in sides]
        return [self.of_side[key] for key in zip(groups, bodies, strict=True)]


class Extent(NamedTuple):
    """How far geoms go beyond the first joint above them, by geom id; leaves `[n, B]`."""

    across: jax.Array
    """At most this from its axis [m]."""
    beyond: jax.Array
    """At most this from its anchor [m]."""

    def of(self, side: Sequence[Sequence[int]]) -> "Extent":
        """The greatest of some geoms, `[n, B]`."""
        rows = [np.array(geoms) for geoms in side]
        if all(len(geoms) == 1 for geoms in rows):
            return Extent(*(leaf[np.concatenate(rows)] for leaf in self))
        return Extent(*(jnp.stack([leaf[g].max(0) for g in rows]) for leaf in self))


def rates_of(scene: Scene) -> np.ndarray:
    """`[n, d]` how far each joint (arm's, passive, dependent) moves per arm's joint."""
    if getattr(scene.structure, "dependent", ()):
        return scene.rates  # pyright: ignore[reportAttributeAccessIssue]
    return np.eye(len(scene.joints) + len(scene.passive), len(scene.joints))


def find_ways(scene: Scene) -> Ways:
    """Which joints count for each side of each contact group."""
    order: dict[Way, int] = {Way((), ()): 0}
    of_side = {}
    for index, group in enumerate(scene.groups):
        bodies = [side.body for side in group.contacts[0]]
        found: dict[int, dict[int, None]] = {body: {} for body in bodies}
        for one, other in product(*(_lines(scene, body) for body in bodies)):
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


def _lines(scene: Scene, body: int) -> list[Way]:
    """All joints of the arm above a body, for what the hand may hold or not."""
    structure = scene.structure
    hand = structure.link_of[scene.body_id(scene.hand)]
    own, thing = _line(scene, structure.link_of[body])
    carrier, base = _line(scene, hand)
    if thing in (-1, base) or scene.objects[thing] in scene.mocap:
        return [Way(own, ())]
    return [Way(own, ((thing, False),)), Way((*own, *carrier), ((thing, True),))]


def _line(scene: Scene, row: int) -> tuple[tuple[int, ...], int]:
    """Rows above with a joint that the arm moves, and the object at the end, or -1."""
    links, moves = scene.structure.links, rates_of(scene).any(1)
    rows, thing = [], -1
    while row:
        link = links[row - 1]
        if link.variable >= 0 and moves[link.variable]:
            rows.append(row)
        row, thing = link.parent, max(thing, link.object)
    return tuple(rows), thing


def link_motion(scene: Scene, motion: jax.Array) -> jax.Array:
    """`[1 + n_links, ...]` how far each link's joint moves; `motion` is `[d, ...]`."""
    rates = np.concatenate([rates_of(scene), np.zeros((1, len(scene.joints)))])
    rows = [-1, *(link.variable for link in scene.structure.links)]
    each = jnp.asarray(rates[rows], motion.dtype)
    return jnp.tensordot(each, jnp.abs(motion), 1, precision="highest")


def extents(scene: Scene, world: World, ways: Ways) -> Extent:
    """How far the geoms go beyond the first joints of their ways.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        ways: `find_ways`.
    """
    poses = link_poses(scene, world, rest(scene, world))
    anchor, axis = joint_axes(scene, poses)
    model = scene.mj_model
    first = {
        body: ways.ways[row].links[0]
        for (_, body), rows in ways.of_side.items()
        for row in rows
    }
    across = jnp.zeros((model.ngeom, poses.shape[-1]), poses.dtype)
    extent = Extent(across, across)
    for kind, geoms in _by_kind(scene, first).items():
        bodies = [int(model.geom_bodyid[geom]) for geom in geoms]
        own = read(scene, geoms)
        placed = in_world(
            own, poses, np.array([scene.structure.link_of[b] for b in bodies])
        )
        rows = np.array([first[body] for body in bodies])
        offset = minus(placed.centre, _coordinates(anchor[rows]))
        turned = cross(offset, _coordinates(axis[rows]))
        spread = core_radius(kind, own)
        extent = Extent(
            extent.across.at[np.array(geoms)].set(_norm(turned) + spread),
            extent.beyond.at[np.array(geoms)].set(_norm(offset) + spread),
        )
    return extent


def _by_kind(scene: Scene, bodies: dict[int, int]) -> dict[str, tuple[int, ...]]:
    """Geoms of some bodies that are in a contact."""
    kinds: dict[str, dict[int, None]] = {}
    for group in scene.groups:
        for side in (side for contact in group.contacts for side in contact):
            if side.body in bodies:
                kinds.setdefault(side.kind, {}).update(dict.fromkeys(side.ids))
    return {kind: tuple(ids) for kind, ids in kinds.items()}


def core_radius(kind: str, shapes: Shapes) -> jax.Array:
    """`[n, 1]` of a ball around the centre that holds the geom, but for its rounding [m].

    A ball that turns about its centre stays what it is, so a sphere has none.
    """
    size = shapes.size
    if kind == "sphere":
        return jnp.zeros_like(size[0])
    if kind == "capsule":
        return size[1]
    if kind == "cylinder":
        return jnp.sqrt(size[0] ** 2 + size[1] ** 2)
    if kind == "ellipsoid":
        return jnp.maximum(jnp.maximum(size[0], size[1]), size[2])
    if kind == "mesh":
        return jnp.max(jnp.sqrt(sum(x * x for x in shapes.vertices)), 0)
    return jnp.sqrt(sum(x * x for x in size))


def rest(scene: Scene, world: World) -> jax.Array:
    """`[d, B]` the joints amid their limits, or at their reference where they have none."""
    low, high = scene.q_min, scene.q_max
    reference = jnp.asarray(scene.model.qpos0)[scene.addresses(scene.joints)]
    middle = jnp.where(jnp.isfinite(low + high), (low + high) / 2, reference)
    width = max(leaf.shape[-1] for leaf in world)
    return jnp.broadcast_to(middle[:, None], (len(middle), width))


def joint_axes(scene: Scene, poses: jax.Array) -> tuple[jax.Array, jax.Array]:
    """A point and the direction of each link's joint in the world, `[1 + n_links, 3, B]`."""
    joints = np.array([0, *(link.joint for link in scene.structure.links)])
    point = scene.model.jnt_pos[joints].T[:, :, None]
    along = scene.model.jnt_axis[joints].T[:, :, None]
    rotation = [poses[:, :, k] for k in range(3)]
    anchor = sum(rotation[k] * point[k][:, None] for k in range(3)) + poses[:, :, 3]
    return anchor, sum(rotation[k] * along[k][:, None] for k in range(3))


def _coordinates(vectors: jax.Array) -> Vector:
    return [vectors[:, k] for k in range(3)]


def _norm(vector: Vector) -> jax.Array:
    return jnp.sqrt(dot(vector, vector))


class Travel(NamedTuple):
    """How the first joints' anchors of all ways move; leaves `[n_ways, B]`."""

    twist: jax.Array
    """The first joint turns by at most this [rad]."""
    shift: jax.Array
    """Its anchor moves by at most this [m]."""
    turn: jax.Array
    """The others turn by at most this together [rad]."""

    def of(self, sides: Sequence[tuple[int, ...]], extent: Extent) -> jax.Array | float:
        """`[n, B]` how far geoms move [m].

        Args:
            sides: n of `Ways.of_side`.
            extent: Of the geoms, `[n, B]` or `[1, B]`.
        """
        longest = max(map(len, sides))
        table = np.array(
            [(*side, *(longest - len(side)) * (0,)) for side in sides], int
        )
        return sum(
            self.twist[rows] * extent.across
            + self.shift[rows]
            + self.turn[rows] * extent.beyond
            for rows in table.reshape(len(sides), longest).T
        )


def travel_from(
    scene: Scene, world: World, ways: Ways, poses: jax.Array, motion: jax.Array
) -> Travel:
    """How far all ways carry, from the configuration at hand.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        ways: `find_ways`.
        poses: `[1 + n_links, 3, 4, B]` where the links are.
        motion: `[d, B]` how far each joint moves at most [rad or m].
    """
    anchor, axis = joint_axes(scene, poses)
    moved = link_motion(scene, motion)
    slides = np.array([False, *(link.slides for link in scene.structure.links)])
    longest = max(len(way.links) for way in ways.ways)
    # Row 0, the world, does not move: it fills the ways up.
    order = np.array([(*w.links, *(longest - len(w.links)) * (0,)) for w in ways.ways])
    order = order.reshape(len(ways.ways), longest)
    first = order[:, 0]
    twist = jnp.where(slides[first][:, None], 0, moved[first])
    shift = turn = jnp.zeros_like(twist)
    for step in range(longest):
        rows = order[:, step]
        offset = _coordinates(anchor[first] - anchor[rows])
        far = _norm(cross(offset, _coordinates(axis[rows])))
        linear, own = slides[rows][:, None], moved[rows]
        shift = shift + own * jnp.where(linear, 1, far + shift)
        if step:
            turn = turn + jnp.where(linear, 0, own)
    travel = Travel(twist, shift, turn)
    if any(way.held for way in ways.ways):
        so = _so(world, ways)
        travel = Travel(*(jnp.where(so, leaf, 0) for leaf in travel))
    # Otherwise it is computed again for each geom.
    return once(travel)


def _so(world: World, ways: Ways) -> jax.Array:
    """`[n_ways, B]` whether what each way supposes to be held is."""
    always = jnp.ones((1, world.held.shape[-1]), bool)
    flags = [
        [always[0], *(world.held[thing] == held for thing, held in way.held)]
        for way in ways.ways
    ]
    return jnp.stack([jnp.all(jnp.stack(own), 0) for own in flags])

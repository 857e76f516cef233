"""Which pair is nearest, by both distances: C MuJoCo's and our own."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from jaxplan.collision.checks import checked
from jaxplan.collision.margins import required_clearances
from jaxplan.collision.oracle import Replica, contacts_of, names_of, nearest
from jaxplan.collision.rows import clearance_rows
from jaxplan.collision.world import World
from jaxplan.ranges import NotNegative, check
from jaxplan.scene import Scene, geom_pairs

Named = tuple[tuple[str, str] | None, float]
"""The names of a pair, and its signed distance [m]."""

ALIKE = 1e-4
"""Distances that differ by less [m] are of the same pair."""


def closest_pair(
    scene: Scene, world: World, q: npt.ArrayLike, reach: float = 0.1
) -> Named:
    """The pair that is nearest to each other, by name, and its distance [m].

    Where C MuJoCo sees no contact, our own distance is asked too. Geoms are named, or
    their bodies where C MuJoCo sees none of their geoms so near.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        q: `[d]` joints [rad].
        reach: Pairs farther apart than this are not looked for [m]; (None, inf) then.
    """
    world, q = checked(scene, world, q=q)
    check("reach", reach, NotNegative)
    row = np.asarray(q, float)[None]
    theirs, geoms = next(nearest(scene, world, row, reach))
    if theirs < 0:
        return names_of(scene, geoms), theirs
    return worst_pair(scene, world, row[0], reach)


class Tight(NamedTuple):
    """The pair that makes a configuration not free."""

    pair: tuple[str, str] | None
    """By name."""
    distance: float
    """Signed [m]."""
    required: float
    """More than this would be free [m]."""


def tightest_pair(
    scene: Scene, world: World, q: npt.ArrayLike, margin: float, reach: float = 0.01
) -> Tight:
    """Of what is not free at q, the pair that is nearest for what it should keep.

    Not always the nearest: the model may ask for more between some geoms than between others
    (`required_clearances`). Where nothing overlaps, and C MuJoCo's distances are all that is
    required, our own is asked, as by `closest_pair`.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        q: `[d]` joints [rad].
        margin: The user's [m].
        reach: Pairs farther apart than this and than any margin are not looked for [m].
    """
    pair, distance = closest_pair(scene, world, q, reach)
    if distance < 0:
        return Tight(pair, distance, 0.0)
    required = np.asarray(required_clearances(scene, margin))
    row, reach = np.asarray(q, float)[None], max(reach, float(required.max()))
    apart, geoms = next(contacts_of(scene, world, row, reach))
    kept = required[geoms[:, 0], geoms[:, 1]]
    if len(apart) and (apart - kept).min() <= 0:
        worst = int(np.argmin(apart - kept))
        i, j = map(int, geoms[worst])
        return Tight(names_of(scene, (i, j)), float(apart[worst]), float(kept[worst]))
    return Tight(pair, distance, margin)


def worst_pair(scene: Scene, world: World, q: np.ndarray, reach: float) -> Named:
    """As `closest_pair`, but our own distance is always asked."""
    row = q[None]
    theirs, geoms = next(nearest(scene, world, row, reach))
    ours = float(clearance_rows(scene, world, row)[0])
    if ours < min(theirs, reach) - ALIKE:
        return _by_ours(scene, world, row, ours), ours
    return names_of(scene, geoms), theirs


def _by_ours(
    scene: Scene, world: World, row: np.ndarray, distance: float
) -> tuple[str, str] | None:
    """What is so near by our own distance: all contact groups but one are ignored in turn."""
    for index in np.flatnonzero(~np.asarray(world.ignored)):
        alone = world._replace(ignored=np.arange(len(scene.groups)) != index)
        if clearance_rows(scene, alone, row)[0] > distance + ALIKE:
            continue
        replica = Replica(scene)
        replica.load(alone, row)
        replica.pose(0)
        contacts = scene.groups[index].contacts
        pairs = [pair for contact in contacts for pair in geom_pairs(contact)]
        apart = [replica.distance(i, j, 1.0) for i, j in pairs]
        nearest_one = int(np.argmin(apart))
        if len(pairs) == 1 or apart[nearest_one] <= distance + 10 * ALIKE:
            return names_of(scene, pairs[nearest_one])
        bodies = [scene.structure.body_names[side.body] for side in contacts[0]]
        return bodies[0], bodies[1]
    return None

"""C MuJoCo's last word on a path."""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from jaxplan.collision.oracle import names_of, nearest
from jaxplan.collision.world import World
from jaxplan.scene import Scene


class Certificate(NamedTuple):
    """What C MuJoCo says about a path."""

    valid: bool
    """No contact that counts is deeper than the tolerance."""
    clearance: float
    """Least signed distance on the path [m], negative = penetration; inf if no contact."""
    pair: tuple[str, str] | None
    """The geoms of the deepest contact, by name."""
    where: float
    """Its place: 2.25 is a quarter of the way from waypoint 2 to waypoint 3."""
    q: np.ndarray | None
    """`[d]` its joints."""


def certify(
    scene: Scene,
    world: World,
    path: npt.ArrayLike,
    resolution: float = 0.01,
    tolerance: float = 0.001,
) -> Certificate:
    """Checks a piecewise linear path densely.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        path: `[n, d]` waypoints [rad].
        resolution: Longest gap between checked configurations [rad].
        tolerance: Penetration that still passes [m].
    """
    places, rows = _densify(np.asarray(path, float), resolution)
    if not np.isfinite(rows).all():
        return Certificate(False, math.nan, None, math.nan, None)
    answers = list(nearest(scene, world, rows, reach=0.0))
    distances = np.array([distance for distance, _ in answers])
    worst = int(distances.argmin())
    least = float(distances[worst])
    if math.isinf(least):
        return Certificate(True, least, None, math.nan, None)
    pair = names_of(scene, answers[worst][1])
    return Certificate(
        least >= -tolerance, least, pair, float(places[worst]), rows[worst]
    )


def _densify(path: np.ndarray, resolution: float) -> tuple[np.ndarray, np.ndarray]:
    """Places on the path no more than `resolution` apart, and their joints."""
    places = [np.zeros(1)]
    for i, step in enumerate(np.linalg.norm(np.diff(path, axis=0), axis=-1)):
        count = max(1, math.ceil(step / resolution)) if np.isfinite(step) else 1
        places.append(i + (np.arange(count) + 1) / count)
    where = np.concatenate(places)
    waypoints = np.arange(len(path))
    rows = np.stack([np.interp(where, waypoints, joint) for joint in path.T], -1)
    return where, rows

"""The last word on a path: two distances that share nothing must agree."""

import math
from numbers import Real
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from jaxplan.collision import faults
from jaxplan.collision.bisect import prove
from jaxplan.collision.closest import worst_pair
from jaxplan.collision.course import Course
from jaxplan.collision.rows import clearance_rows
from jaxplan.collision.world import World
from jaxplan.scene import Scene

SIGHT = 0.1
"""The nearest pair is named if it is no farther apart than this [m]; no more is proven."""
FINEST = 1e-4
"""A proven clearance may be this much too low [m]."""


class Certificate(NamedTuple):
    """What C MuJoCo and our own distance say about a path."""

    valid: bool
    """By neither is a pair that counts deeper than the tolerance: where it was checked, or
    anywhere (`proven`)."""
    clearance: float
    """Least signed distance [m], negative = penetration: where it was checked, or, if
    `proven`, a lower bound of it, at most 0.1, on all of the path. NaN: not measured."""
    pair: tuple[str, str] | None
    """The geoms (or bodies) that are nearest to each other, by name; None beyond 0.1 m."""
    where: float
    """Their place: 2.25 is a quarter of the way from waypoint 2 to waypoint 3."""
    q: np.ndarray | None
    """`[d]` its joints."""
    reason: str = ""
    """Why it is not valid, in a line."""
    proven: bool | None = None
    """Whether it holds between checked configurations too; None: not asked."""


def certify(
    scene: Scene,
    world: World,
    path: npt.ArrayLike,
    resolution: float = 0.005,
    tolerance: float = 0.001,
    continuous: bool = False,
) -> Certificate:
    """Checks a piecewise linear path, by C MuJoCo and by our own distance.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        path: `[n, d]` waypoints [rad or m], at least one. Joints without limits go the
            short way round from one to the next.
        resolution: No two geoms move by more than this against each other between two
            checked configurations [m], by a bound.
        tolerance: Penetration that still passes [m].
        continuous: Prove it between the checked configurations as well. The clearance is
            then a lower bound, too low by at most about `resolution`.

    Raises:
        ValueError: The path has another shape or is not of numbers, the world is of another
            scene or has batch axes, or the resolution or tolerance makes no sense.
    """
    if not (_number(resolution) and 0 < resolution < math.inf):
        raise ValueError(f"resolution {resolution!r}, expected more than 0 [m]")
    if not (_number(tolerance) and 0 <= tolerance < math.inf):
        raise ValueError(f"tolerance {tolerance!r}, expected at least 0 [m]")
    if not isinstance(continuous, bool | np.bool_):
        raise ValueError(f"continuous {continuous!r}, expected True or False")
    waypoints = _waypoints(path, len(scene.joints))
    world = faults.one_world(scene, world)
    proven = False if continuous else None
    if fault := faults.of_scene(scene) or faults.of_world(scene, world):
        return Certificate(False, math.nan, None, math.nan, None, fault, proven)
    if fault := faults.of_path(scene, waypoints):
        said, row = fault
        q = waypoints[row]
        return Certificate(False, math.nan, None, float(row), q, said, proven)
    course = Course(scene, world, waypoints)
    sampled = _sampled(course, resolution, tolerance)
    if not continuous:
        return sampled
    if not sampled.valid:
        return sampled._replace(proven=False)
    most = min(sampled.clearance, SIGHT)
    proof = prove(course, max(-tolerance, most - max(resolution, FINEST)), most)
    if math.isnan(proof.stuck):
        return sampled._replace(clearance=proof.clearance, proven=True)
    q = course.rows(np.array([proof.stuck]))[0]
    pair, distance = worst_pair(scene, world, q, SIGHT)
    reason = f"{_said(pair, distance)} at {proof.stuck:.3f}"
    if distance >= -tolerance:
        reason = f"not proven: {reason}"
    return Certificate(False, distance, pair, proof.stuck, q, reason, False)


def _sampled(course: Course, resolution: float, tolerance: float) -> Certificate:
    """Where no two geoms move by more than `resolution` from one place to the next."""
    places = course.places(resolution)
    rows = course.rows(places)
    ours = clearance_rows(course.scene, course.world, rows)
    theirs = np.array([*course.contact_depths(rows)])
    both = np.minimum(ours, theirs)
    worst = int(both.argmin())
    least, where, q = float(both[worst]), float(places[worst]), rows[worst]
    if math.isnan(least):
        reason = f"the distance at {where:.3f} is not a number"
        return Certificate(False, least, None, where, q, reason)
    pair, _ = worst_pair(course.scene, course.world, q, SIGHT)
    if least >= -tolerance:
        return Certificate(True, least, pair, where, q)
    sides = ("C MuJoCo", theirs[worst]), ("jaxplan", ours[worst])
    who = " and ".join(name for name, depth in sides if depth < -tolerance)
    reason = f"{_said(pair, least)} at {where:.3f}, by {who}"
    return Certificate(False, least, pair, where, q, reason)


def _said(pair: tuple[str, str] | None, distance: float) -> str:
    """A pair and its distance in words."""
    names = "two geoms" if pair is None else " and ".join(pair)
    state = "deep" if distance < 0 else "apart"
    return f"{names}, {1000 * abs(distance):.2f} mm {state}"


def _number(value: object) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _waypoints(path: npt.ArrayLike, d: int) -> np.ndarray:
    """`[n, d]`, checked."""
    try:
        given = np.asarray(path)
        # Objects (integers beyond 64 bits, None, a list in a list) are numbers or not.
        casting = "unsafe" if given.dtype == object else "same_kind"
        waypoints = given.astype(float, casting=casting)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"path is not an array of numbers: {path!r}"[:200]) from None
    if waypoints.ndim != 2 or waypoints.shape[1] != d or not len(waypoints):
        raise ValueError(
            f"path has shape {waypoints.shape}, expected (waypoints, {d}), at least one"
        )
    return waypoints

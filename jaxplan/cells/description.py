"""A robot's cell in a few lines: what stands where, within which ranges, and what is asked.

    {"obstacles": [{"kind": "box", "size": [[0.02, 0.1, 0.1], [0.05, 0.2, 0.3]],
                    "position": [[0.3, -0.3, 0.1], [0.6, 0.3, 0.3]], "yaw": [-1.6, 1.6],
                    "share": 0.8}],
     "objects": {"cup": {"position": [[0.1, -0.6, 0.08], [0.3, -0.4, 0.08]]}},
     "start": "home",
     "goal": {"body": "hand", "position": [[0.3, -0.4, 0.2], [0.6, 0.4, 0.5]]}}

Two rows are a range, one is a value. A goal or start is a key frame, numbers, a range of numbers
`{"from": [...], "to": [...]}`, a pose of a body whose position may be a range, or nothing: any
configuration. What is drawn is free and within the limits.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from jaxplan.cells.problem import (
    Problem,
    configuration,
    furnish,
    pose,
    refuse_unknown,
    slots_of,
)
from jaxplan.collision import Obstacle, World
from jaxplan.ik import Pose
from jaxplan.motion import Planner
from jaxplan.scene import Scene

ATTEMPTS = 100
"""Worlds that are drawn for one problem until something in it can be asked."""
TRIES = 64
"""Configurations that are tried in one world."""
FIELDS = ("obstacles", "objects", "start", "goal")


class Cell:
    """Problems of a scene, drawn at random.

    Args:
        planner: Of the scene; says what is free.
        given: The description.

    Raises:
        ValueError: It makes no sense, in one line.
    """

    def __init__(self, planner: Planner, given: Mapping[str, Any]) -> None:
        refuse_unknown(given, FIELDS, "a description")
        self._planner, self._scene = planner, planner.scene
        self._obstacles = [_Thing(each, True) for each in given.get("obstacles", ())]
        self._objects = {
            name: _Thing(each, False) for name, each in given.get("objects", {}).items()
        }
        self._ends = [
            _end(self._scene, planner, given.get(name), name)
            for name in ("start", "goal")
        ]
        self.draw(0, 0)  # what is wrong is said before the work begins

    def draw(self, seed: int, number: int) -> Problem:
        """A problem, by seed and number alone.

        Raises:
            ValueError: Nothing can be asked in any of the worlds that were drawn.
        """
        rng = np.random.default_rng([seed, number])
        for _ in range(ATTEMPTS):
            obstacles = [o for each in self._obstacles for o in each.obstacles(rng)]
            objects = {name: each.pose(rng) for name, each in self._objects.items()}
            world = furnish(self._scene, self._planner.empty_world, obstacles, objects)
            ends = [end(rng, world) for end in self._ends]
            if ends[0] is not None and ends[1] is not None:
                return Problem(ends[0], ends[1], world)
        raise ValueError(
            f"no free start and goal in {ATTEMPTS} worlds that were drawn: "
            "see obstacles, start and goal of the description"
        )


def slots_needed(given: Mapping[str, Any]) -> dict[str, int]:
    """Slots of each kind that a scene needs for the worlds of a description."""
    refuse_unknown(given, FIELDS, "a description")
    return slots_of([{"obstacles": given.get("obstacles", ())}])


class _Thing:
    """An obstacle or object, somewhere."""

    def __init__(self, given: Mapping[str, Any], obstacle: bool) -> None:
        more = ("kind", "size", "share") if obstacle else ()
        refuse_unknown(given, ("position", "yaw", *more), "an obstacle or object")
        if missing := [n for n in ("position", *more[:2]) if n not in given]:
            raise ValueError(f"an obstacle or object without {missing[0]}")
        self._kind = given.get("kind", "")
        self._position = _span(given["position"], "position")
        self._size = _span(given["size"], "size") if obstacle else None
        self._yaw = _span(_columns(given.get("yaw", 0.0)), "yaw")
        self._share = float(given.get("share", 1.0))

    def pose(self, rng: np.random.Generator) -> np.ndarray:
        """`[7]`."""
        half = 0.5 * float(_within(self._yaw, rng)[0])
        turned = np.cos(half), 0.0, 0.0, np.sin(half)
        return np.concatenate([_within(self._position, rng), turned])

    def obstacles(self, rng: np.random.Generator) -> list[Obstacle]:
        """One, or none."""
        assert self._size is not None
        there = rng.random() < self._share
        size, where = _within(self._size, rng), self.pose(rng)
        kind = self._kind
        return [Obstacle(kind, size.tolist(), where.tolist())] if there else []


End = Callable[[np.random.Generator, World], Any]
"""What is drawn in a world, or None where nothing is free."""


def _end(scene: Scene, planner: Planner, given: Any, name: str) -> End:
    """A start or goal of a description."""
    if isinstance(given, Mapping) and "body" in given:
        one = {**given, "position": (0, 0, 0)} if "position" in given else given
        pose(one)  # says what is wrong in it
        position = _span(given["position"], "position")

        def reached(rng: np.random.Generator, world: World) -> Any:
            wanted: Any = dict(given) | {"position": _within(position, rng)}
            q = planner.ik(
                Pose(**wanted), world, seed=int(rng.integers(2**31)), count=1
            )
            return q[0] if len(q) else None

        return reached
    if given is None:
        low, high = (np.asarray(x, float) for x in (planner.q_min, planner.q_max))
        span = (
            np.where(np.isfinite(low), low, -np.pi),
            np.where(np.isfinite(high), high, np.pi),
        )
    elif isinstance(given, Mapping):
        refuse_unknown(given, ("from", "to"), name)
        if len(given) != 2:
            raise ValueError(f"{name} with from or to alone")
        span = _span(
            [configuration(scene, given[e], name) for e in ("from", "to")], name
        )
    else:
        span = _span(configuration(scene, given, name), name)
    margin = planner.config.margin

    def free(rng: np.random.Generator, world: World) -> Any:
        q = np.stack([_within(span, rng) for _ in range(TRIES)])
        ok = np.flatnonzero(planner.clearance(q, world) > margin)
        return q[ok[0]] if len(ok) else None

    return free


def _columns(given: Any) -> Any:
    """A number or a range of numbers, as a span of one column has it."""
    return [given] if np.ndim(given) == 0 else [[x] for x in given]


def _span(given: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """From and to; one row is both."""
    try:
        array = np.asarray(given, float)
    except (TypeError, ValueError):
        array = np.zeros((0, 0))
    if array.ndim == 1:
        array = np.stack([array, array])
    if array.shape[:1] != (2,) or array.ndim != 2 or not np.isfinite(array).all():
        raise ValueError(f"{name} {given!r}, expected numbers, or two rows of them")
    if (array[0] > array[1]).any():
        raise ValueError(f"{name} {given!r}: the first row is above the second")
    return array[0], array[1]


def _within(
    span: tuple[np.ndarray, np.ndarray], rng: np.random.Generator
) -> np.ndarray:
    return rng.uniform(*span)

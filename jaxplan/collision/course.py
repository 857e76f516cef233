"""A path to be judged: its places, and how far geoms move between them."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from jaxplan.collision.oracle import Replica
from jaxplan.collision.travel import Travel
from jaxplan.collision.world import World
from jaxplan.scene import Scene

SHORT = 0.1
"""Half a piece moves joints by no more than this in sum [rad or m]: bounds stay tight."""


class Stretches(NamedTuple):
    """Parts of a path, none with a waypoint inside."""

    low: np.ndarray
    """`[n]` where each begins: 2.25 is a quarter of the way from waypoint 2 to 3."""
    high: np.ndarray
    """`[n]` where it ends."""
    motion: np.ndarray
    """`[n]` no two geoms move by more than this against each other on it [m]."""

    def halves(self, which: np.ndarray) -> "Stretches":
        """Both halves of some of them."""
        low, high, motion = (leaf[which] for leaf in self)
        middle = (low + high) / 2
        ends = np.append(low, middle), np.append(middle, high)
        return Stretches(*ends, np.tile(motion / 2, 2))


class Course:
    """A piecewise linear path in one world, with C MuJoCo's model of it.

    Args:
        scene: The scene.
        world: One world, in NumPy.
        path: `[n, d]` waypoints. Joints without limits go the short way round.
    """

    def __init__(self, scene: Scene, world: World, path: np.ndarray) -> None:
        turns = scene.circular
        path = path.copy()
        path[:, turns] = np.unwrap(path[:, turns], axis=0)
        self.scene, self.world, self._path = scene, world, path
        self.replica = Replica(scene)
        self.replica.load(world, path[:1])
        self.travel = Travel(scene, self.replica, np.asarray(world.held), path)
        self.pieces = self._pieces()

    def rows(self, places: np.ndarray) -> np.ndarray:
        """`[n, d]` joints at places `[n]`."""
        waypoints = np.arange(len(self._path))
        joints = (np.interp(places, waypoints, joint) for joint in self._path.T)
        return np.stack([*joints], -1)

    def middles(self, parts: Stretches) -> tuple[np.ndarray, np.ndarray]:
        """`[n, d]` joints in the middle of each, and how far they go from there."""
        half = np.abs(self.rows(parts.high) - self.rows(parts.low)) / 2
        return self.rows((parts.low + parts.high) / 2), half

    def contact_depths(self, rows: np.ndarray) -> Iterator[float]:
        """C MuJoCo's least signed distance of each row [m]; inf where nothing touches."""
        self.replica.load(self.world, rows)
        for row in range(len(rows)):
            self.replica.pose(row)
            yield float(self.replica.contacts(0.0)[0].min(initial=math.inf))

    def places(self, resolution: float) -> np.ndarray:
        """Places between which no two geoms move by more than `resolution` [m]."""
        count = np.maximum(1, np.ceil(self.pieces.motion / resolution)).astype(int)
        last = np.cumsum(count)
        step = (
            np.arange(last[-1] if len(last) else 0) + 1 - np.repeat(last - count, count)
        )
        low, high = (np.repeat(leaf, count) for leaf in self.pieces[:2])
        share = step / np.repeat(count, count)
        return np.append(0.0, low + share * (high - low))

    def _pieces(self) -> Stretches:
        """The path in pieces so short that one bound is good for all of a piece."""
        length = np.abs(np.diff(self._path, axis=0)).sum(-1)
        count = np.maximum(1, np.ceil(length / (2 * SHORT))).astype(int)
        ends = [i + np.arange(n + 1) / n for i, n in enumerate(count)]
        low = np.concatenate([[], *(e[:-1] for e in ends)])
        high = np.concatenate([[], *(e[1:] for e in ends)])
        pieces = Stretches(low, high, np.zeros(len(low)))
        middle, half = self.middles(pieces)
        self.replica.load(self.world, middle)
        for row in range(len(middle)):
            self.replica.pose(row)
            # From one end to the other: twice as far as from the middle.
            pieces.motion[row] = 2 * self.travel.most(self.travel.sides(half[row]))
        return pieces

"""Motions for the episode loop: repair the ends, search, smooth, time, for a batch of problems.

The public `Planner` is for problems of users, one by one or in batches of any size.
"""

import time
from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from numpy.typing import ArrayLike

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.config import (
    EXECUTED_TRAJECTORY,
    PAPER_PLANNER,
    PlannerConfig,
    TrajectoryConfig,
)
from jaxplan.motion.search import sampled_search
from jaxplan.planning import DrawBank, PlanResult
from jaxplan.robots import JointLimits
from jaxplan.scene import Scene
from jaxplan.trajectory import Rung, make_trajectory, points_free

NEAR = 0.15
"""How far from a start or goal in collision a free configuration is looked for [rad]."""
NEIGHBOURS = 128
"""How many are tried."""


class Motion(NamedTuple):
    """P planned motions."""

    result: PlanResult
    q: list[np.ndarray]
    """Commands sampled at the control period, (T_p, d) each [rad]; empty: do not execute."""
    rung: np.ndarray
    """[P] the `Rung` of each trajectory."""
    seconds: float
    """Wall time of the search of the whole batch [s], smoothing left out."""

    def then(self, other: "Motion", lanes: np.ndarray) -> "Motion":
        """The other's motions for some lanes `[P]` bool that were searched again; costs add up."""

        def either(mine: np.ndarray, its: np.ndarray) -> np.ndarray:
            return np.where(lanes.reshape(-1, *[1] * (mine.ndim - 1)), its, mine)

        result = jax.tree.map(either, self.result, other.result)
        costs = ("expansions", "accepted", "learned", "checks")
        added = {
            name: getattr(self.result, name)
            + np.where(lanes, getattr(other.result, name), 0)
            for name in costs
        }
        q = [
            its if lane else mine
            for mine, its, lane in zip(self.q, other.q, lanes, strict=True)
        ]
        rung = either(self.rung, other.rung)
        seconds = self.seconds + other.seconds
        return Motion(result._replace(**added), q, rung, seconds)


class MotionPlanner:
    """Plans batches of motions in one scene, whose worlds differ from problem to problem.

    Everything compiles once for a batch size.

    Args:
        scene: What collides.
        limits: Of position, velocity and acceleration.
        planner: Settings of the search.
        trajectory: Settings of what follows it.
    """

    def __init__(
        self,
        scene: Scene,
        limits: JointLimits,
        planner: PlannerConfig = PAPER_PLANNER,
        trajectory: TrajectoryConfig = EXECUTED_TRAJECTORY,
    ) -> None:
        self.scene, self.limits = scene, limits
        self._trajectory = trajectory

        search = sampled_search(scene, planner, limits)
        self._config_free, self.search = search.free_rows, search()
        self._offsets = _neighbours(len(limits.q_min))

    def plan(
        self,
        worlds: World,
        q_start: ArrayLike,
        q_goal: ArrayLike,
        q_toggle: ArrayLike,
        keys: jax.Array,
        draw: DrawBank | None = None,
        active: ArrayLike | None = None,
        speed: ArrayLike | None = None,
    ) -> Motion:
        """Searches, smooths and times P motions; see `make_planner` and `make_trajectory`.

        A start or goal in collision is replaced by the nearest free configuration within
        `NEAR`, as a goal that was predicted from a picture may lie a hair inside an obstacle; a
        motion from such a start begins with the straight way out.

        Args:
            worlds: Leaves [P, ...].
            q_start: [P, d] [rad].
            q_goal: [P, d] [rad].
            q_toggle: [P, d] [rad].
            keys: [P] typed keys.
            draw: Learned segments; without it all proposals are uniform.
            active: [P], false for padding lanes.
            speed: [P] factors on the velocity limits, their squares on the accelerations.
        """
        q_start = np.asarray(q_start, np.float32)
        q_goal = np.asarray(q_goal, np.float32)
        began = time.perf_counter()
        first = self.nearest_free(worlds, q_start)
        last = self.nearest_free(worlds, q_goal)
        result = jax.block_until_ready(
            self.search(worlds, first, last, q_toggle, keys, draw, active)
        )
        seconds = time.perf_counter() - began
        result = jax.tree.map(np.asarray, result)
        factor = np.reshape(np.ones(len(first)) if speed is None else speed, (-1, 1))
        velocity = factor * self.limits.velocity
        acceleration = factor**2 * self.limits.acceleration
        timed = make_trajectory(
            result.path,
            result.path_length,
            keys,
            partial(self._config_free, worlds),
            velocity,
            acceleration,
            self._trajectory,
        )
        period = self._trajectory.control_period
        commands = []
        for p, length in enumerate(timed.length):
            if result.path_length[p] < 1 or timed.rung[p] == Rung.INVALID:
                commands.append(timed.q[p, :0])
                continue
            escape = _straight(
                q_start[p], first[p], velocity[p], acceleration[p], period
            )
            commands.append(np.concatenate([escape, timed.q[p, :length]]))
        return Motion(result, commands, timed.rung, seconds)

    def reason(self, worlds: World, lane: int, q: np.ndarray) -> str:
        """What is nearest at `q` [rad] in a lane's world, for a message."""
        world = jax.tree.map(lambda leaf: leaf[lane], worlds)
        pair, distance = collision.closest_pair(self.scene, world, q)
        if pair is None:
            return "nothing"
        return f"{pair[0]} and {pair[1]}, {1000 * distance:.1f} mm apart"

    def nearest_free(self, worlds: World, q: np.ndarray) -> np.ndarray:
        """`q` [P, d] [rad], but the nearest free neighbour where it is in collision and has one.

        Joints outside the limits, or not finite, are left for the search to refuse.
        """
        low, high = self.limits.q_min, self.limits.q_max
        free = self._free(worlds, np.arange(len(q)), q)
        inside = np.all((low <= q) & (q <= high), axis=1)
        blocked = np.flatnonzero(~free & inside)
        near = np.clip(q[blocked, None] + self._offsets, low, high).astype(np.float32)
        rows = np.repeat(blocked, NEIGHBOURS)
        found = self._free(worlds, rows, near.reshape(-1, q.shape[1]))
        found = found.reshape(-1, NEIGHBOURS)
        q = q.copy()
        for lane, candidates, ok in zip(blocked, near, found, strict=True):
            if ok.any():
                q[lane] = candidates[ok.argmax()]
        return q

    def _free(self, worlds: World, problem: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Whether each configuration is free, in calls of the one compiled shape."""
        config_free = partial(self._config_free, worlds)
        return points_free(
            config_free, problem.tolist(), list(q[:, None]), self._trajectory.check_rows
        )


def _neighbours(joints: int) -> np.ndarray:
    """Offsets `[NEIGHBOURS, joints]` in fixed random directions, growing up to `NEAR` [rad]."""
    offsets = np.random.default_rng(0).normal(size=(NEIGHBOURS, joints))
    offsets /= np.linalg.norm(offsets, axis=1, keepdims=True)
    return offsets * np.linspace(0, NEAR, NEIGHBOURS + 1)[1:, None]


def _straight(
    q0: np.ndarray,
    q1: np.ndarray,
    velocity: np.ndarray,
    acceleration: np.ndarray,
    period: float,
) -> np.ndarray:
    """Samples of a straight rest-to-rest motion but its end: `[T, d]`, empty if q0 is q1."""
    distance = np.abs(q1 - q0)
    # Peaks of the quintic time law: 15/8 of the mean velocity, 10/sqrt(3) d / T^2.
    duration = max(
        (15 / 8 * distance / velocity).max(),
        np.sqrt((10 / np.sqrt(3) * distance / acceleration).max()),
    )
    s = np.linspace(0, 1, int(np.ceil(duration / period)) + 1)[:-1, None]
    return q0 + (10 * s**3 - 15 * s**4 + 6 * s**5) * (q1 - q0)

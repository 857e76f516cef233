"""From one configuration to another in a scene: search, smooth, time. Compiled once per batch size."""

import time
from functools import partial
from typing import NamedTuple

import jax
import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.config import PlannerConfig, TrajectoryConfig
from jaxplan.planning import PlanResult, make_planner
from jaxplan.scene import Scene
from jaxplan.scene.panda import JointLimits
from jaxplan.trajectory import Rung, make_trajectory

jit = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


class Motion(NamedTuple):
    """P planned motions."""

    result: PlanResult
    q: list[np.ndarray]
    """Commands sampled at the control period, (T_p, d) each [rad]; empty where none may be executed."""
    rung: np.ndarray
    """[P] the `Rung` of each trajectory."""
    seconds: float
    """Wall time of the search of the whole batch [s], smoothing left out."""


NEAR = 0.15
"""How far from a start or goal in collision a free configuration is looked for [rad]."""


class MotionPlanner:
    """Plans batches of motions in one scene, whose worlds differ from problem to problem.

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
        planner: PlannerConfig = PlannerConfig(),
        trajectory: TrajectoryConfig = TrajectoryConfig(),
    ) -> None:
        self.scene, self.limits = scene, limits
        self._trajectory_config = trajectory

        def config_free(worlds, problem, q):
            return collision.config_free(
                scene, _rows(worlds, problem), q, planner.margin
            )

        points = collision.points_for(planner.step_max, planner.edge_resolution)

        def motion_free(worlds, problem, q0, q1):
            return collision.motion_free(
                scene, _rows(worlds, problem), q0, q1, points, planner.margin
            )

        offsets = np.random.default_rng(0).normal(size=(128, len(limits.q_min)))
        radii = np.linspace(0, NEAR, 129)[1:, None]
        self._offsets = offsets / np.linalg.norm(offsets, axis=1, keepdims=True) * radii
        self._config_free = jit(config_free)
        self._search = make_planner(
            motion_free, config_free, planner, limits.q_min, limits.q_max, jit
        )

    def plan(
        self,
        worlds: World,
        q_start,
        q_goal,
        q_toggle,
        keys,
        draw=None,
        active=None,
        speed=None,
    ) -> Motion:
        """Searches, smooths and times P motions; see `make_planner` and `make_trajectory`.

        A start or goal in collision is replaced by the nearest free configuration within `NEAR`,
        as a goal that was predicted from a picture may lie a hair inside an obstacle; a motion
        from such a start begins with the straight way out. `speed` [P] is a factor on
        each problem's velocity limits, and its square on the accelerations (1 if None).
        """
        start = time.perf_counter()
        q_start, q_goal = (
            np.asarray(q_start, np.float32),
            np.asarray(q_goal, np.float32),
        )
        first, last = (
            self._nearest_free(worlds, q_start),
            self._nearest_free(worlds, q_goal),
        )
        result = jax.block_until_ready(
            self._search(worlds, first, last, q_toggle, keys, draw, active)
        )
        seconds = time.perf_counter() - start
        result = jax.tree.map(np.asarray, result)
        speed = (
            np.ones((len(result.path), 1))
            if speed is None
            else np.reshape(speed, (-1, 1))
        )
        velocity, acceleration = (
            speed * self.limits.velocity,
            speed**2 * self.limits.acceleration,
        )
        timed = make_trajectory(
            result.path, result.path_length, keys, partial(self._config_free, worlds),
            velocity, acceleration, self._trajectory_config,
        )  # fmt: skip
        commands = []
        for p, length in enumerate(timed.length):
            if result.path_length[p] < 1 or timed.rung[p] == Rung.INVALID:
                commands.append(timed.q[p, :0])
                continue
            escape = _straight(
                q_start[p],
                first[p],
                velocity[p],
                acceleration[p],
                self._trajectory_config.control_period,
            )
            commands.append(np.concatenate([escape, timed.q[p, :length]]))
        return Motion(result, commands, timed.rung, seconds)

    def reason(self, worlds: World, lane: int, q) -> str:
        """What is in the way at `q` [rad] in a lane's world, for a message."""
        world = jax.tree.map(lambda leaf: leaf[lane], worlds)
        pair, distance = collision.closest_pair(self.scene, world, q)
        return (
            "nothing"
            if pair is None
            else f"{pair[0]} and {pair[1]}, {1000 * distance:.1f} mm apart"
        )

    def _nearest_free(self, worlds: World, q: np.ndarray) -> np.ndarray:
        """`q` [P, d] itself where it is free, else the nearest free one of fixed offsets, else `q`."""
        free = np.asarray(self._config_free(worlds, np.arange(len(q)), q))
        if free.all():
            return q
        near = np.clip(
            q[:, None] + self._offsets, self.limits.q_min, self.limits.q_max
        ).astype(np.float32)
        rows = np.repeat(np.arange(len(q)), near.shape[1])
        found = np.asarray(
            self._config_free(worlds, rows, near.reshape(-1, q.shape[1]))
        ).reshape(near.shape[:2])
        best = near[np.arange(len(q)), found.argmax(1)]
        return np.where((~free & found.any(1))[:, None], best, q)


def _straight(
    q0: np.ndarray, q1: np.ndarray, velocity, acceleration, period: float
) -> np.ndarray:
    """Samples of a straight rest-to-rest motion, its end left out: (T, d), empty if there is nothing to do."""
    distance = np.abs(q1 - q0)
    # Peaks of the quintic time law: 15/8 of the mean velocity, 10/sqrt(3) d / T^2.
    duration = max(
        (15 / 8 * distance / velocity).max(),
        np.sqrt((10 / np.sqrt(3) * distance / acceleration).max()),
    )
    s = np.linspace(0, 1, int(np.ceil(duration / period)) + 1)[:-1, None]
    return q0 + (10 * s**3 - 15 * s**4 + 6 * s**5) * (q1 - q0)


def _rows(worlds: World, problem: jax.Array) -> World:
    """The world of each row."""
    return jax.tree.map(lambda leaf: leaf[problem], worlds)

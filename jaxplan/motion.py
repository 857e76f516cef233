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
from jaxplan.trajectory import Trajectory, make_trajectory

jit = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


class Motion(NamedTuple):
    """P planned motions."""

    result: PlanResult
    trajectory: Trajectory
    seconds: float
    """Wall time of the search of the whole batch [s], smoothing left out."""


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
            return collision.config_free(scene, _rows(worlds, problem), q, planner.margin)

        points = collision.points_for(planner.step_max, planner.edge_resolution)

        def motion_free(worlds, problem, q0, q1):
            return collision.motion_free(scene, _rows(worlds, problem), q0, q1, points, planner.margin)

        self._config_free = jit(config_free)
        self._search = make_planner(motion_free, config_free, planner, limits.q_min, limits.q_max, jit)

    def plan(self, worlds: World, q_start, q_goal, q_toggle, keys, draw=None, active=None, speed=None) -> Motion:
        """Searches, smooths and times P motions; see `make_planner` and `make_trajectory`.

        The trajectory of a problem without a path stays at q_start. `speed` [P] is a factor on
        each problem's velocity limits, and its square on the accelerations (1 if None).
        """
        start = time.perf_counter()
        result = jax.block_until_ready(self._search(worlds, q_start, q_goal, q_toggle, keys, draw, active))
        seconds = time.perf_counter() - start
        result = jax.tree.map(np.asarray, result)
        speed = np.ones((len(result.path), 1)) if speed is None else np.reshape(speed, (-1, 1))
        trajectory = make_trajectory(
            result.path, result.path_length, keys, partial(self._config_free, worlds),
            speed * self.limits.velocity, speed**2 * self.limits.acceleration, self._trajectory_config,
        )  # fmt: skip
        return Motion(result, trajectory, seconds)


def _rows(worlds: World, problem: jax.Array) -> World:
    """The world of each row."""
    return jax.tree.map(lambda leaf: leaf[problem], worlds)

"""Variations of MotionBenchMaker's problems: what a sampler is trained on, where they are few."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from jaxplan.cells import Problem
from jaxplan.collision import Obstacle, make_world
from jaxplan.evaluation.motion_bench import BenchProblem
from jaxplan.ik import Pose
from jaxplan.motion import Planner

ATTEMPTS = 50
"""Variations that are tried until one has a free start and goal."""


class Spread(NamedTuple):
    """How far variations are from what they vary."""

    shift: tuple[float, float, float] = (0.06, 0.06, 0.04)
    """Of everything together, and with it of the goal; in the mean as far as half of it [m]."""
    turn: float = 0.2
    """Of everything together about the robot's axis [rad]."""
    own_shift: float = 0.01
    """Of each obstacle [m]."""
    size: float = 0.1
    """Of each obstacle's size, as a share."""
    start: float = 0.1
    """Of each joint at the start [rad]."""


SPREAD = Spread()


def vary(
    planner: Planner,
    hand: Pose,
    problem: BenchProblem,
    seed: Sequence[int],
    spread: Spread = SPREAD,
) -> Problem:
    """A problem like another: moved, turned, its obstacles changed, and the goal along with them.

    Args:
        planner: Of the scene, which has slots for the obstacles.
        hand: Where the hand is at the problem's goal.
        problem: What is varied.
        seed: Of the random numbers.
        spread: How far.

    Raises:
        ValueError: No variation has a free start and goal.
    """
    rng = np.random.default_rng(seed)
    for _ in range(ATTEMPTS):
        angle = rng.uniform(-spread.turn, spread.turn)
        turn = Rotation.from_euler("z", angle)
        shift = rng.uniform(-1, 1, 3) * spread.shift
        world = make_world(
            planner.scene,
            obstacles=[_moved(o, turn, shift, rng, spread) for o in problem.obstacles],
        )
        wxyz = np.asarray(hand.quaternion)
        goal = Pose(
            hand.body,
            turn.apply(hand.position) + shift,
            _wxyz(turn * Rotation.from_quat(np.roll(wxyz, -1))),
        )
        start = (
            problem.q_start + rng.uniform(-1, 1, len(problem.q_start)) * spread.start
        )
        start = np.clip(start, planner.q_min, planner.q_max)
        if planner.clearance(start, world) <= 0:
            continue
        near = problem.q_goal + np.eye(len(start))[0] * angle
        found = planner.ik(goal, world, near, int(rng.integers(2**31)), count=1)
        if len(found):
            return Problem(start, found[0], world)
    raise ValueError(f"{problem.set} {problem.index} has no variation")


def _moved(
    obstacle: Obstacle,
    turn: Rotation,
    shift: np.ndarray,
    rng: np.random.Generator,
    spread: Spread,
) -> Obstacle:
    pose = np.asarray(obstacle.pose, float)
    own = rng.uniform(-1, 1, 3) * spread.own_shift
    size = np.asarray(obstacle.size) * (1 + rng.uniform(-1, 1) * spread.size)
    rotation = turn * Rotation.from_quat(np.roll(pose[3:], -1))
    position = turn.apply(pose[:3]) + shift + own
    pose = np.concatenate([position, _wxyz(rotation)])
    return Obstacle(obstacle.kind, size.tolist(), pose.tolist())


def _wxyz(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1)

"""Where a problem may lead: a configuration, any of several, or a pose of a body."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jaxplan.collision import World
from jaxplan.ik import Limits, Pose, inverse_kinematics
from jaxplan.motion import checks
from jaxplan.planning import Status
from jaxplan.planning.space import short_way
from jaxplan.scene import Scene

MOST = 64
"""Goals of a problem at most: those nearest to the start."""
OF_POSE = 8
"""Configurations that a pose is planned to at most."""
BLOCK = 256
"""Configurations of one check."""


class Goals(NamedTuple):
    """The goals of one problem."""

    q: np.ndarray
    """`[G, d]` to plan to, from the nearest to the start on; one at least [rad or m]."""
    given: int
    """How many there were."""
    status: Status | None
    """What the problem comes to where nothing is worth a search."""
    blocked: np.ndarray
    """`[k, d]` those that are not free, from the nearest on."""


def goals_of(
    goal: ArrayLike | Pose,
    q_start: np.ndarray,
    scene: Scene,
    world: World,
    limits: Limits,
    seed: int,
    free: Callable[[np.ndarray], ArrayLike],
) -> Goals:
    """Reads a goal `[d]`, a set of goals `[G, d]`, or a pose.

    Args:
        goal: As the user gave it.
        q_start: `[d]` [rad or m].
        scene: Of the problem.
        world: Of the problem.
        limits: Of the joints.
        seed: Of the problem.
        free: `[B, d] -> [B]` bool.

    Raises:
        ValueError: It is none of these.
    """
    if isinstance(goal, Pose):
        return _of_pose(goal, q_start, scene, world, limits, seed, free)
    d = len(q_start)
    q = np.atleast_2d(checks.rows(goal, None, d, "q_goal"))
    if q.ndim != 2 or not len(q):
        raise ValueError(f"q_goal has shape {q.shape}, expected ({d},) or (goals, {d})")
    if len(q) == 1:
        return Goals(q, 1, None, q[:0])
    gap = np.where(limits.circular, short_way(q - q_start), q - q_start)
    q = q[np.argsort(np.linalg.norm(gap, axis=1), kind="stable")]
    within = np.isfinite(q) & (q >= limits.q_min) & (q <= limits.q_max)
    inside = np.asarray(within.all(1))
    ok = inside.copy()
    for first in range(0, len(q), BLOCK):
        part = np.arange(first, min(first + BLOCK, len(q)))
        ok[part] &= np.asarray(free(q[np.resize(part, BLOCK)]))[: len(part)]
    # Of what is not inside the limits, the search says what is wrong with it.
    return _chosen(q[ok][:MOST], q[inside & ~ok], len(q), (q[:1], None))


def _of_pose(
    pose: Pose,
    q_start: np.ndarray,
    scene: Scene,
    world: World,
    limits: Limits,
    seed: int,
    free: Callable[[np.ndarray], ArrayLike],
) -> Goals:
    """Configurations that reach a pose."""
    if not np.isfinite(q_start).all():
        return Goals(q_start[None], 1, Status.INVALID_INPUT, q_start[None][:0])
    found = inverse_kinematics(
        scene, world, pose, limits, q_start, seed, OF_POSE, free
    )  # fmt: skip
    q, blocked = (x.astype(np.float32) for x in (found.q, found.blocked))
    nowhere = q_start[None], Status.GOAL_UNREACHABLE
    return _chosen(q, blocked, len(q) + len(blocked), nowhere)


def _chosen(
    ok: np.ndarray,
    blocked: np.ndarray,
    given: int,
    otherwise: tuple[np.ndarray, Status | None],
) -> Goals:
    """Those that are free, or the nearest that is not, or `(q, status)` where there is none."""
    if len(ok):
        return Goals(ok, given, None, blocked)
    if len(blocked):
        return Goals(blocked[:1], given, Status.GOAL_IN_COLLISION, blocked)
    q, status = otherwise
    return Goals(q, given, status, blocked)


def stacked(goals: list[Goals]) -> np.ndarray:
    """`[P, G, d]`, G such that it seldom changes; a problem's first goal fills it up."""
    most = max(len(goal.q) for goal in goals)
    size = 1 << (most - 1).bit_length()
    return np.stack([goal.q[np.arange(size) % len(goal.q)] for goal in goals])

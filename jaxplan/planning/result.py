"""What a planner hands back for each problem."""

from enum import IntEnum
from typing import NamedTuple

import jax


class Status(IntEnum):
    """How the search of one problem ended."""

    SOLVED = 0
    BUDGET_EXHAUSTED = 1
    """`max_expansions` used up; the path leads to the best node reached."""
    START_IN_COLLISION = 2
    GOAL_IN_COLLISION = 3
    OUT_OF_LIMITS = 4
    """q_start or q_goal lies outside the joint limits."""
    INVALID_INPUT = 5
    """q_start, q_goal or q_toggle is not finite."""
    INACTIVE = 6
    """A padding lane of the batch: nothing was asked."""
    TIME_OUT = 7
    """The time limit came first; the path leads to the best node reached."""
    GOAL_UNREACHABLE = 8
    """No configuration within the limits brings the body to the pose."""


class PlanResult(NamedTuple):
    """The answer to P problems; W waypoints at most, d joints."""

    path: jax.Array
    """`[P, W, d]` from q_start to q_goal or the best node, the last point repeated [rad]."""
    path_length: jax.Array
    """`[P]` number of waypoints; 0 where nothing was searched."""
    status: jax.Array
    """`[P]` a `Status`."""
    expansions: jax.Array
    """`[P]` proposals, accepted and rejected, each connect step one."""
    accepted: jax.Array
    """`[P]` expansions that added a node."""
    learned: jax.Array
    """`[P]` learned segments drawn from the bank."""
    checks: jax.Array
    """`[P]` configurations of motions that were checked."""
    nodes: jax.Array
    """`[P, 2]` nodes of the start's tree and of the goal's, their roots included."""

"""Answers of the planner: a path, and the motion that is made from it."""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxplan.collision import World
from jaxplan.planning import Status


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """The answer to one problem."""

    status: Status
    path: np.ndarray
    """`[n, d]` waypoints from q_start to q_goal [rad or m]; where the budget was exhausted, to
    the node nearest to the goal; without rows where nothing was searched."""
    expansions: int
    checks: int
    """Configurations of motions that were checked."""
    time: float
    """Wall time of the search [s]; in a batch, of the whole batch."""
    reason: str
    """Why there is no path, in a line; empty where there is one."""
    seed: int
    world: World

    @property
    def solved(self) -> bool:
        """Whether the path leads to the goal."""
        return self.status == Status.SOLVED

    @property
    def length(self) -> float:
        """Of the path, in joint space [rad, or m of slides]."""
        return float(np.linalg.norm(np.diff(self.path, axis=0), axis=1).sum())


class Timed(NamedTuple):
    """A motion from rest to rest, sampled at the control period."""

    t: np.ndarray
    """`[T]` [s], from 0."""
    q: np.ndarray
    """`[T, d]` [rad or m]."""
    qd: np.ndarray
    """`[T, d]` [rad/s or m/s]."""
    qdd: np.ndarray
    """`[T, d]` [rad/s^2 or m/s^2]; the one that holds from each sample on."""
    free: bool
    """Every sample is; false only if the world has changed since the plan was made."""

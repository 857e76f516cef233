"""What the episode loop, the networks and the experts need to know of a robot."""

from collections.abc import Callable
from typing import NamedTuple

import mujoco
import numpy as np


class JointLimits(NamedTuple):
    """Limits of an arm's d joints, each `[d]`.

    Attributes:
        q_min: lower position limits [rad].
        q_max: upper position limits [rad].
        velocity: largest speeds [rad/s].
        acceleration: largest accelerations [rad/s^2].
    """

    q_min: np.ndarray
    q_max: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


class Gripper(NamedTuple):
    """Finger commands [m]: they ramp, since a step topples or misses what it should grasp."""

    open: float
    closed: float
    release: float
    """A release opens each finger by this much; the rest follows once the hand is away."""
    speed: float
    """Ramp [m/s]."""
    settle: float
    """The arm stands still this long after a toggle [s]."""
    met: float
    """Fingers nearer than this to the middle hold nothing [m]."""


class Mount(NamedTuple):
    """Where the camera is on the hand, and its lens."""

    position: tuple[float, float, float]
    """In the hand's frame [m]."""
    tilt: float
    """About the hand's y, from straight ahead [rad]."""
    fovy: float
    """Vertical field of view [deg]."""
    height: int
    width: int
    """Of its image [px]."""


class HandChain(NamedTuple):
    """The joints from the base to the hand, for who knows the joints and not the model."""

    links: tuple[tuple[float, float, float], ...]
    """Craig's (a [m], d [m], alpha [rad]) of each joint."""
    flange: float
    """From the last joint to the hand's frame along z [m]."""
    turn: float
    """And about z [rad]."""


class Robot(NamedTuple):
    """An arm with a parallel gripper and a camera on its hand.

    In its model the arm's joints come first, then the fingers; actuators likewise.
    """

    name: str
    spec: Callable[[], mujoco.MjSpec]
    """A fresh model: physics in group 3, planning's spheres in group 4, looks in group 2."""
    limits: JointLimits
    gripper: Gripper
    q_home: np.ndarray
    """`[d]` the hand over the table, looking down [rad]."""
    chain: HandChain
    mount: Mount
    fingers: int = 2
    hand: str = "hand"
    """Body of the hand."""
    tcp: str = "tcp"
    """Site of the tool centre point."""
    pads: tuple[str, str] = ("left_pad", "right_pad")
    """Geoms that hold things."""

    @property
    def dof(self) -> int:
        """d, the arm's joints."""
        return len(self.limits.q_min)

    @property
    def arm(self) -> slice:
        """Where qpos and ctrl hold the arm."""
        return slice(0, self.dof)

    @property
    def finger_slice(self) -> slice:
        """Where qpos and ctrl hold the fingers."""
        return slice(self.dof, self.dof + self.fingers)

"""The hand's camera on a Panda: the joint table that leads to the hand, and the mount on it."""

from typing import NamedTuple

import numpy as np

LINKS = (
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
)
"""Craig's (a [m], d [m], alpha [rad]) of each joint, as the maker gives them."""
FLANGE, HAND_TURN = 0.107, -np.pi / 4
"""From the last joint to the hand's frame: along z [m], about z [rad]."""


class Mount(NamedTuple):
    """Where the camera is on the hand, and its lens."""

    position: tuple[float, float, float] = (-0.065, 0.0, 0.0)
    """In the hand's frame [m]."""
    tilt: float = -0.12
    """About the hand's y, from straight ahead [rad]."""
    fovy: float = 50.0
    """Vertical field of view [deg]."""
    height: int = 88
    width: int = 136
    """Of its image [px]."""


MOUNT = Mount()

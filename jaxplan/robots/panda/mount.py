"""The hand's camera on a Panda: the joint table that leads to the hand, and the mount on it."""

import numpy as np

from jaxplan.robots.robot import HandChain, Mount

CHAIN = HandChain(
    links=(
        (0.0, 0.333, 0.0),
        (0.0, 0.0, -np.pi / 2),
        (0.0, 0.316, np.pi / 2),
        (0.0825, 0.0, np.pi / 2),
        (-0.0825, 0.384, -np.pi / 2),
        (0.0, 0.0, np.pi / 2),
        (0.088, 0.0, np.pi / 2),
    ),
    flange=0.107,
    turn=-np.pi / 4,
)
"""As the maker gives it."""
MOUNT = Mount(position=(-0.065, 0.0, 0.0), tilt=-0.12, fovy=50.0, height=88, width=136)

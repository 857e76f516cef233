"""What counts: when an episode is over, and whether it succeeded."""

import numpy as np

from jaxplan.tasks.mug.scene import BOX_INNER

MAX_TILT = np.radians(20)
MAX_SPEED = 0.01
"""Of a mug at rest [m/s]."""
HAND_CLEAR = 0.05
"""Least distance of the tool centre point from the mug's centre [m]."""


def in_terminal_region(tcp: np.ndarray, closed: bool, box: np.ndarray) -> bool:
    """Q_term: gripper open, tool centre point `[3]` low over the target box at `box [3]` [m]."""
    over_box = np.all(np.abs(tcp[:2] - box[:2]) < BOX_INNER + 0.02)
    return bool(not closed and over_box and tcp[2] < 0.12)


def failure(
    mug: np.ndarray,
    speed: float,
    tcp: np.ndarray,
    closed: bool,
    touching: bool,
    box: np.ndarray,
) -> str | None:
    """Why an episode that is over is no success; None if the mug stands in the box.

    Args:
        mug: Its pose, `[4, 4]`.
        speed: Of its centre [m/s].
        tcp: The tool centre point, `[3]` [m].
        closed: Whether the gripper is closed.
        touching: Whether a pad touches the mug.
        box: Where the box stands, `[3]` [m].
    """
    off_centre = np.abs((mug[:3, 3] - box)[:2])
    checks = {
        "the mug is outside the box": np.any(off_centre > BOX_INNER),
        "the mug is not upright": mug[2, 2] < np.cos(MAX_TILT),
        "the mug is not at rest": speed > MAX_SPEED,
        "the gripper is closed": closed,
        "the hand is not clear": touching
        or np.linalg.norm(tcp - mug[:3, 3]) < HAND_CLEAR,
    }
    return next((reason for reason, failed in checks.items() if failed), None)

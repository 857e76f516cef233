"""Where an episode begins."""

from typing import NamedTuple

import numpy as np

from jaxplan.tasks.mug.mug import MugShape
from jaxplan.tasks.starts import Starts


class MugRange(NamedTuple):
    """Where `reset` puts the mug: uniform in each, lying, its handle on either side."""

    x: tuple[float, float] = (0.400, 0.552)
    y: tuple[float, float] = (-0.127, 0.127)
    yaw: tuple[float, float] = (np.radians(43.5), np.radians(144.5))
    """Direction of the opening [rad]."""
    roll: float = np.radians(8)
    """Largest angle by which the handle is off its resting place [rad]."""
    pitch: float = np.radians(3)
    drop: float = 0.006
    """Height above the table at the start [m]."""


RANGE = MugRange()


def sample_pose(
    seed: int, shape: MugShape = MugShape()
) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and rotation matrix from which the mug of a seed is dropped."""
    rng = np.random.default_rng(seed)
    x, y, yaw = rng.uniform(*np.array([RANGE.x, RANGE.y, RANGE.yaw]).T)
    right = bool(rng.integers(2))
    pitch, off = rng.uniform(-RANGE.pitch, RANGE.pitch), rng.uniform(0, RANGE.roll)
    # At rest the handle's tip touches the table: this far below the horizontal, on either side.
    rest = np.arcsin(shape.radius / shape.handle_reach)
    angle = np.pi + rest - off if right else -rest + off
    axis = np.array(
        [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
    )
    side = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    handle = np.cos(angle) * side + np.sin(angle) * np.cross(axis, side)
    rotation = np.stack([handle, np.cross(axis, handle), axis], 1)
    return np.array([x, y, shape.radius + RANGE.drop]), rotation


def in_range(mug: np.ndarray) -> bool:
    """Whether a pose `[4, 4]` lies in `RANGE`, with a centimetre and two degrees of slack."""
    yaw = np.arctan2(mug[1, 2], mug[0, 2])
    inside = [
        low - slack <= value <= high + slack
        for value, (low, high), slack in (
            (mug[0, 3], RANGE.x, 0.01),
            (mug[1, 3], RANGE.y, 0.01),
            (yaw, RANGE.yaw, np.radians(2)),
        )
    ]
    return bool(all(inside) and abs(mug[2, 2]) < 0.1)


def start_of(seed: int) -> dict[str, float | str]:
    """Of a seed, by the names in `STARTS`."""
    position, rotation = sample_pose(seed)
    axis, handle = rotation[:, 2], rotation[:, 0]
    left = np.cross([0.0, 0.0, 1.0], axis) @ handle > 0
    return {
        "x [m]": float(position[0]),
        "y [m]": float(position[1]),
        "direction of the opening [deg]": float(
            np.degrees(np.arctan2(axis[1], axis[0]))
        ),
        "side of the handle": "left" if left else "right",
    }


PITCH, ROLL = (round(float(np.degrees(a)), 1) for a in (RANGE.pitch, RANGE.roll))
STARTS = Starts(
    ranges={
        "x [m]": RANGE.x,
        "y [m]": RANGE.y,
        "direction of the opening [deg]": (
            float(np.degrees(RANGE.yaw[0])),
            float(np.degrees(RANGE.yaw[1])),
        ),
    },
    choices={"side of the handle": ("left", "right")},
    others={
        "handle off its resting place [deg]": [0.0, ROLL],
        "pitch [deg]": [-PITCH, PITCH],
    },
    of=start_of,
)

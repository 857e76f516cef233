"""Where a body is wanted: a position, an orientation, and how much of either is enough."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from jaxplan.scene import Scene
from jaxplan.scene.names import known

LEAST = 1e-5
"""Least tolerance [m or rad]: what single precision can tell."""


@dataclasses.dataclass(frozen=True, eq=False)
class Pose:
    """A region of poses of one body, in the world.

    Without more than a body and a position, any orientation will do.

    Raises:
        ValueError: A value that makes no sense.
    """

    body: str
    """Name of a body that the arm moves; or of a site, where no body is called so."""
    position: ArrayLike
    """`[3]` [m]."""
    quaternion: ArrayLike | None = None
    """`[4]` (w, x, y, z), of any length but 0; None: any orientation."""
    free: Literal["x", "y", "z"] | None = None
    """Axis of the body about which it may turn as it likes."""
    position_tolerance: ArrayLike = 1e-3
    """Of each coordinate, or `[3]` along the world's axes [m]; inf: anywhere along it."""
    rotation_tolerance: float = math.radians(0.1)
    """Angle by which the orientation may differ [rad]; with `free`, that axis of the body."""
    offset: ArrayLike = (0.0, 0.0, 0.0)
    """`[3]` the point of the body that is to be at `position`, in its frame [m]."""

    def __post_init__(self) -> None:
        own = {
            "position": _numbers(self.position, "position", 3),
            "offset": _numbers(self.offset, "offset", 3),
            "position_tolerance": _tolerance(
                self.position_tolerance, "position_tolerance", (3,)
            ),
            "rotation_tolerance": float(
                _tolerance(self.rotation_tolerance, "rotation_tolerance", ())
            ),
        }
        if self.quaternion is not None:
            quaternion = _numbers(self.quaternion, "quaternion", 4)
            if not quaternion.any():
                raise ValueError("quaternion is zero, which is no rotation")
            quaternion = quaternion / np.abs(quaternion).max()
            own["quaternion"] = quaternion / np.linalg.norm(quaternion)
        if not isinstance(self.body, str):
            raise ValueError(f"body {self.body!r}, expected a name")
        if self.free not in (None, "x", "y", "z"):
            raise ValueError(f"free {self.free!r}, expected 'x', 'y', 'z' or None")
        if self.free and self.quaternion is None:
            raise ValueError(
                f"free {self.free!r} needs a quaternion: without one any orientation will do"
            )
        for name, value in own.items():
            object.__setattr__(self, name, value)


class Region(NamedTuple):
    """Poses of one body as the solver reads them, the batch last."""

    position: Any
    """`[3, B]` of a point of the body, in the world [m]."""
    quaternion: Any
    """`[4, B]` of the body, in the world."""
    offset: Any
    """`[3, B]` the point, in the body's frame [m]."""
    axis: Any
    """`[3, B]` in the body's frame: free to turn about it; zeros = not free."""
    tolerance: Any
    """`[4, B]` of the three coordinates [m] and of the angle [rad]."""


def regions(scene: Scene, poses: Sequence[Pose]) -> tuple[str, Region]:
    """The body that all of the poses are of, and they themselves.

    Raises:
        ValueError: There is no such body or site, or there are several.
    """
    names = {pose.body for pose in poses}
    if len(names) != 1:
        raise ValueError(f"poses of one body at a time, not of {sorted(names)}")
    name, model = names.pop(), scene.mj_model
    sites = [model.site(i).name for i in range(model.nsite)]
    bodies = scene.structure.body_names
    known(name, "body or site", [*bodies, *filter(None, sites)])
    if name in bodies:
        body, place, turn = name, np.zeros(3), Rotation.identity()
    else:
        site = sites.index(name)
        body, place = bodies[model.site_bodyid[site]], model.site_pos[site]
        turn = Rotation.from_quat(model.site_quat[site], scalar_first=True)
    rows = [
        (
            pose.position,
            [1, 0, 0, 0]
            if pose.quaternion is None
            else (
                Rotation.from_quat(pose.quaternion, scalar_first=True) * turn.inv()
            ).as_quat(scalar_first=True),
            place + turn.apply(pose.offset),
            turn.apply(np.eye(3)["xyz".index(pose.free)]) if pose.free else np.zeros(3),
            [
                *np.asarray(pose.position_tolerance),
                np.inf if pose.quaternion is None else pose.rotation_tolerance,
            ],
        )
        for pose in poses
    ]
    columns = zip(*rows, strict=True)
    return body, Region(*(np.array(column, np.float32).T for column in columns))


def _numbers(value: ArrayLike, name: str, count: int) -> np.ndarray:
    """`[count]`, finite."""
    numbers = _array(value, name)
    if numbers.shape != (count,):
        raise ValueError(f"{name} has shape {numbers.shape}, expected ({count},)")
    if not np.isfinite(numbers).all():
        raise ValueError(f"{name} is not finite: {numbers.tolist()}")
    return numbers


def _tolerance(value: ArrayLike, name: str, shape: tuple[int, ...]) -> np.ndarray:
    """`shape`, each at least `LEAST`."""
    numbers = _array(value, name)
    if numbers.shape not in ((), shape):
        expected = "a number" if shape == () else "a number or 3"
        raise ValueError(f"{name} has shape {numbers.shape}, expected {expected}")
    if not (numbers >= LEAST).all():
        raise ValueError(f"{name} {numbers.tolist()}, expected at least {LEAST}")
    return np.broadcast_to(numbers, shape)


def _array(value: ArrayLike, name: str) -> np.ndarray:
    try:
        return np.array(value, float)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is not an array of numbers: {error}") from None

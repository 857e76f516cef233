"""Obstacles that come and go: what fills a scene's slots."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.scene import Scene
from jaxplan.scene.names import known

SIZES = {
    "sphere": ("radius",),
    "capsule": ("radius", "half length"),
    "cylinder": ("radius", "half length"),
    "ellipsoid": ("3 semi-axes",) * 3,
    "box": ("3 half sides",) * 3,
}
"""Numbers that give an obstacle's size."""
FAR = (0.0, 0.0, 1000.0, 1.0, 0.0, 0.0, 0.0)
"""Where an empty slot is: out of reach of everything."""


class Obstacle(NamedTuple):
    """Something that fills a slot."""

    kind: str
    """sphere, capsule, cylinder, ellipsoid or box."""
    size: Sequence[float]
    """As MuJoCo's: radius; radius and half length; half sides or semi-axes [m]."""
    pose: Sequence[float]
    """`[7]` position [m] and quaternion (w, x, y, z); a position alone is enough."""


def fill(scene: Scene, obstacles: Iterable[Obstacle]) -> tuple[jax.Array, jax.Array]:
    """`slot_pose` and `slot_size` with each obstacle in the first free slot of its kind.

    Raises:
        ValueError: An obstacle makes no sense, or there is no slot of its kind left.
    """
    pose = np.tile(np.array(FAR, np.float32), (len(scene.slots), 1))
    size = np.full((len(scene.slots), 3), 0.01, np.float32)
    free: dict[str, list[int]] = {}
    for index, slot in enumerate(scene.slots):
        free.setdefault(slot.kind, []).append(index)
    for obstacle in obstacles:
        own_size, own_pose = _checked(obstacle)
        if not free.get(obstacle.kind):
            raise ValueError(
                f"no slot is left for a {obstacle.kind}: the scene has "
                f"{sum(slot.kind == obstacle.kind for slot in scene.slots)} "
                "(see `slots` of Scene.from_mjcf)"
            )
        index = free[obstacle.kind].pop(0)
        pose[index], size[index, : len(own_size)] = own_pose, own_size
    return jnp.asarray(pose), jnp.asarray(size)


def _checked(obstacle: Obstacle) -> tuple[np.ndarray, np.ndarray]:
    """Its size, and its pose `[7]`."""
    if not isinstance(obstacle, Obstacle):
        raise ValueError(f"{obstacle!r} is no Obstacle(kind, size, pose)")
    names = SIZES[known(str(obstacle.kind), "kind of slot", tuple(SIZES))]
    size, pose = _floats(obstacle.size), _floats(obstacle.pose)
    wanted = " and ".join(dict.fromkeys(names))
    if size.shape != (len(names),) or not (size > 0).all() or not _finite(size):
        raise ValueError(
            f"{obstacle.kind} has size {obstacle.size!r}, expected {wanted}: "
            f"[{len(names)}] more than 0 [m]"
        )
    if pose.shape == (3,):
        pose = np.concatenate([pose, FAR[3:]])
    if pose.shape != (7,) or not _finite(pose) or not pose[3:].any():
        raise ValueError(
            f"{obstacle.kind} has pose {obstacle.pose!r}, expected a position [3] [m], or "
            "[7] with a quaternion (w, x, y, z) that is not zero"
        )
    return size, pose


def _floats(values: Any) -> np.ndarray:
    """In single precision; of no shape that is right where they are no numbers."""
    try:
        with np.errstate(over="ignore"):
            return np.asarray(values, np.float32)
    except (TypeError, ValueError):
        return np.array(np.nan)


def _finite(values: np.ndarray) -> bool:
    return bool(np.isfinite(values).all())

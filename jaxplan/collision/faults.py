"""What makes a path or a world senseless, in a line; nothing if it makes sense."""

import numpy as np

from jaxplan.collision.world import OWN_AXES, World, make_world
from jaxplan.scene import Scene

SLACK = 1e-4
"""Joints may be beyond their limits by as much as this [rad or m]: rounding."""


def one_world(scene: Scene, world: World) -> World:
    """The world in NumPy.

    Raises:
        ValueError: It is no world, has batch axes, or is one of another scene.
    """
    if not isinstance(world, World):
        raise ValueError(f"world is of type {type(world).__name__}, not a World")
    leaves = []
    for name, leaf, own, axes in zip(
        World._fields, world, make_world(scene), OWN_AXES, strict=True
    ):
        try:
            given = np.asarray(leaf, own.dtype)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(
                f"world.{name} {leaf!r} is not an array of numbers"
            ) from None
        if given.ndim > axes and given.shape[-axes:] == own.shape:
            raise ValueError(
                f"world.{name} has shape {given.shape}, with batch axes; a certificate is "
                f"for one world: {own.shape}"
            )
        if given.shape != own.shape:
            raise ValueError(
                f"world.{name} has shape {given.shape}, this scene's has {own.shape}"
            )
        leaves.append(given)
    return World(*leaves)


def of_scene(scene: Scene) -> str:
    """What is wrong with the scene's numbers."""
    for name, leaf in scene.model._asdict().items():
        if not np.isfinite(np.asarray(leaf)).all():
            return f"the scene's {name} is not finite"
    return ""


def of_world(scene: Scene, world: World) -> str:
    """What is wrong with a world, as `one_world` returns it."""
    slots = [scene.geom_name(slot.geom) for slot in scene.slots]
    shaped = [scene.geom_name(geom) for geom in scene.shaped]
    sizes = (slots, world.slot_size), (shaped, world.geom_size)
    poses = (scene.objects, world.object_pose), (slots, world.slot_pose)
    for names, rows in (
        *poses,
        *sizes,
        (shaped, world.geom_pos),
        (scene.passive, world.passive[:, None]),
    ):
        for name, row in zip(names, rows, strict=True):
            if not np.isfinite(row).all():
                return f"{name!r} is not finite in the world: {row.tolist()}"
    for names, rows in poses:
        for name, row in zip(names, rows, strict=True):
            if not row[3:].any():
                return f"{name!r} has a quaternion of zeros"
    for names, rows in sizes:
        for name, row in zip(names, rows, strict=True):
            if (row < 0).any():
                return f"{name!r} has a negative size: {row.tolist()}"
    for name, held in zip(scene.objects, world.held, strict=True):
        if held and name in scene.mocap:
            return f"{name!r} is held, which a mocap body cannot be"
    return ""


def of_path(scene: Scene, path: np.ndarray) -> tuple[str, int] | None:
    """What is wrong with waypoints `[n, d]`, and in which of them."""
    low, high = np.asarray(scene.q_min), np.asarray(scene.q_max)
    for row, joint in np.argwhere(~np.isfinite(path)):
        value = path[row, joint]
        return f"waypoint {row}: joint {scene.joints[joint]!r} is {value}", int(row)
    for row, joint in np.argwhere((path < low - SLACK) | (path > high + SLACK)):
        return (
            f"waypoint {row} out of limits: joint {scene.joints[joint]!r} at "
            f"{path[row, joint]:.4f}, limits {low[joint]:.4f} to {high[joint]:.4f}",
            int(row),
        )
    return None

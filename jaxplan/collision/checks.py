"""A question about configurations, checked before anything is traced."""

from typing import Any

import jax
import numpy as np

from jaxplan.collision.world import OWN_AXES, World
from jaxplan.ranges import check, numbers, shown
from jaxplan.scene import Scene

FLAGS = "world.held", "world.ignored"


def checked(scene: Scene, world: World, **q: Any) -> tuple[Any, ...]:
    """The world and configurations as arrays; by their shapes only, as JAX may trace them.

    Args:
        scene: The scene.
        world: Leaves with leading axes, or without.
        **q: Configurations `[..., d]`, by the name of the argument.

    Returns:
        `(world, *q)`.

    Raises:
        ValueError: What is no scene, no world of it, or no array of `d` joints, by name.
    """
    check("scene", scene, Scene)
    if not isinstance(world, World):
        raise ValueError(f"world {shown(world)} is not a World, see make_world")
    objects, slots = len(scene.objects), len(scene.slots)
    groups, passive, shaped = len(scene.groups), len(scene.passive), len(scene.shaped)
    own = (objects, 7), (objects,), (passive,), (groups,), (slots, 7), (slots, 3)
    own = *own, (shaped, 3), (shaped, 3)
    leaves = [
        _array(f"world.{name}", leaf, shape)
        for name, leaf, shape in zip(World._fields, world, own, strict=True)
    ]
    rows = [_array(name, value, (len(scene.joints),)) for name, value in q.items()]
    leading = [
        leaf.shape[: leaf.ndim - n] for leaf, n in zip(leaves, OWN_AXES, strict=True)
    ]
    try:
        np.broadcast_shapes(*leading, *(row.shape[:-1] for row in rows))
    except ValueError:
        axes = [str(row.shape) for row in rows]
        raise ValueError(
            f"the world's leading axes {', '.join(map(str, dict.fromkeys(leading)))} do "
            f"not fit those of {', '.join(q)}, {', '.join(axes)}"
        ) from None
    return World(*leaves), *rows


def _array(name: str, value: Any, own: tuple[int, ...]) -> Any:
    """An array of numbers, or of flags where the world has these; its last axes are `own`."""
    if name in FLAGS and isinstance(value, np.ndarray | list | tuple):
        value = np.asarray(value, bool)
    elif not isinstance(value, jax.Array):
        value = numbers(name, value)
    if value.shape[max(value.ndim - len(own), 0) :] != own:
        wanted = ", ".join(map(str, ("...", *own)))
        raise ValueError(f"{name} has shape {value.shape}, expected ({wanted})")
    return value

"""What changes between queries: where things are, what is held, what may touch."""

from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from jaxplan.scene import Scene


class World(NamedTuple):
    """A pytree of arrays, so nothing recompiles when it changes.

    Leading batch axes `...` are allowed on every leaf and broadcast against those of q.
    """

    object_pose: jax.Array
    """`[..., n_objects, 7]` position [m] and quaternion (w, x, y, z) of each movable
    object: in the world, or in the hand body's frame while it is held."""
    held: jax.Array
    """`[..., n_objects]` bool: the object moves with the hand."""
    passive: jax.Array
    """`[..., n_passive]` positions of the joints that are not the arm's (fingers) [m]."""
    ignored: jax.Array
    """`[..., n_groups]` bool: contacts that this phase allows (`Scene.ignored`)."""


def make_world(
    scene: Scene,
    object_pose: npt.ArrayLike | None = None,
    held: npt.ArrayLike | None = None,
    passive: npt.ArrayLike | None = None,
    ignored: Iterable[str] = (),
) -> World:
    """A world; what is not given is as in the model's reference pose.

    Args:
        scene: The scene.
        object_pose: `[..., n_objects, 7]`, see `World`.
        held: `[..., n_objects]` bool; none by default.
        passive: `[..., n_passive]` [m].
        ignored: Names of contact groups, such as "hand|mug".
    """
    reference = scene.mj_model.qpos0
    start = [object_address(scene, name) for name in scene.objects]
    if object_pose is None:
        object_pose = np.array([reference[a : a + 7] for a in start]).reshape(-1, 7)
    if held is None:
        held = np.zeros(len(scene.objects), bool)
    if passive is None:
        passive = reference[
            [int(scene.mj_model.joint(name).qposadr[0]) for name in scene.passive]
        ]
    return World(
        jnp.asarray(object_pose, jnp.float32),
        jnp.asarray(held, bool),
        jnp.asarray(passive, jnp.float32),
        jnp.asarray(scene.ignored(ignored)),
    )


def batch_shape(world: World, q: jax.Array | np.ndarray) -> tuple[int, ...]:
    """Common leading shape of the world's leaves and of q `[..., d]`."""
    return jnp.broadcast_shapes(
        q.shape[:-1],
        world.object_pose.shape[:-2],
        world.held.shape[:-1],
        world.passive.shape[:-1],
        world.ignored.shape[:-1],
    )


def object_address(scene: Scene, name: str) -> int:
    """Where the object's free joint starts in qpos."""
    model = scene.mj_model
    return int(model.jnt_qposadr[model.body(name).jntadr[0]])

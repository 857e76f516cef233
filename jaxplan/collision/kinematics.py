"""Forward kinematics with the batch as the last axis.

Each link's pose is one array behind an optimization barrier: without it XLA recomputes
the whole chain for every sphere that hangs on it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.world import World
from jaxplan.scene import Joint, Scene


class Pose(NamedTuple):
    """A frame in the world. The last axis is the batch, or 1 where nothing moves it."""

    rotation: jax.Array
    """`[3, 3, B]`"""
    position: jax.Array
    """`[3, B]` [m]"""


IDENTITY = Pose(np.eye(3, dtype=np.float32)[..., None], np.zeros((3, 1), np.float32))


def body_poses(scene: Scene, world: World, q: jax.Array) -> dict[int, Pose]:
    """Poses of the bodies that collision needs, by body id.

    Args:
        scene: The scene.
        world: Leaves with the batch last: `[n_objects, 7, B]`, `[n_objects, B]`,
            `[n_passive, B]`; B may be 1.
        q: `[d, B]` joints [rad or m].
    """
    poses = {0: IDENTITY}
    hand = int(scene.mj_model.body(scene.hand).id)
    for body in scene.structure.bodies:
        if body.object >= 0:
            pose = _object_pose(world, body.object, poses[hand])
        else:
            local = _local_pose(scene, world, q, body.id, body.joints)
            pose = compose(poses[body.parent], local)
        poses[body.id] = Pose(*jax.lax.optimization_barrier(tuple(pose)))
    return poses


def compose(a: Pose, b: Pose) -> Pose:
    """The frame b, given in a, in the world."""
    return Pose(
        _product(a.rotation, b.rotation), turn(a.rotation, b.position) + a.position
    )


def turn(rotation: jax.Array, vectors: jax.Array) -> jax.Array:
    """Rotates `[3, ..., B]` vectors by `[3, 3, B]`."""
    middle = (1,) * (vectors.ndim - 2)
    columns = rotation.reshape(3, 3, *middle, rotation.shape[-1])
    return sum(columns[:, j] * vectors[j] for j in range(3))


def turn_back(rotation: jax.Array, vectors: jax.Array) -> jax.Array:
    """Rotates `[3, ..., B]` vectors by the inverse of `[3, 3, B]`."""
    return turn(jnp.swapaxes(rotation, 0, 1), vectors)


def rotation_of(quat: jax.Array) -> jax.Array:
    """Rotation matrices `[3, 3, ...]` of quaternions (w, x, y, z) `[4, ...]`."""
    w, x, y, z = quat / jnp.sqrt(jnp.sum(quat * quat, 0))
    return jnp.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _product(a: jax.Array, b: jax.Array) -> jax.Array:
    """Products of `[3, 3, B]` matrices, written out: a batched dot is slow on CPU."""
    return sum(a[:, j, None] * b[None, j] for j in range(3))


def _local_pose(
    scene: Scene, world: World, q: jax.Array, body: int, joints: tuple[Joint, ...]
) -> Pose:
    """A body's pose in its parent's frame, its joints included."""
    model = scene.model
    rotation = rotation_of(model.body_quat[body])[..., None]
    position = model.body_pos[body][:, None]
    for joint in joints:
        start = model.qpos0[int(scene.mj_model.jnt_qposadr[joint.id])]
        value = q[joint.arm] if joint.arm >= 0 else world.passive[joint.passive]
        axis, anchor = model.jnt_axis[joint.id], model.jnt_pos[joint.id][:, None]
        if joint.slides:
            position += turn(rotation, axis[:, None] * (value - start))
        else:
            position += turn(rotation, anchor)
            rotation = _product(rotation, _about(axis, value - start))
            position -= turn(rotation, anchor)
    return Pose(rotation, position)


def _about(axis: jax.Array, angle: jax.Array) -> jax.Array:
    """Rotation `[3, 3, B]` about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = jnp.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    squared = jnp.outer(axis, axis) - jnp.eye(3)
    sine, cosine = jnp.sin(angle), jnp.cos(angle)
    return (
        jnp.eye(3)[..., None]
        + cross[..., None] * sine
        + squared[..., None] * (1 - cosine)
    )


def _object_pose(world: World, index: int, hand: Pose) -> Pose:
    held = world.held[index]
    base = Pose(
        jnp.where(held, hand.rotation, IDENTITY.rotation),
        jnp.where(held, hand.position, IDENTITY.position),
    )
    given = world.object_pose[index]
    return compose(base, Pose(rotation_of(given[3:]), given[:3]))

"""Forward kinematics with the batch as the last axis.

A loop over the links, and on purpose not unrolled: XLA on CPU fuses an unrolled chain
into whatever uses it and computes the whole arm again for every sphere. The loop's
buffer is a wall that it does not cross.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.world import World
from jaxplan.scene import Link, Scene


def link_poses(scene: Scene, world: World, q: jax.Array) -> jax.Array:
    """Poses of the links that collision needs (`Structure.links`).

    Args:
        scene: The scene.
        world: Leaves with the batch last: `[n_objects, 7, B]`, `[n_objects, B]`,
            `[n_passive, B]`; B may be 1.
        q: `[d, B]` joints [rad or m].

    Returns:
        `[1 + n_links, 3, 4, B]`: rotation and position [m] in the world; row 0 is the
        world itself.
    """
    links, hand = scene.structure.links, _hand_row(scene)
    carried = [
        world.held[link.object] if link.object >= 0 else jnp.zeros(1, bool)
        for link in links
    ]
    steps = (
        jnp.arange(len(links)) + 1,
        jnp.array([link.parent for link in links]),
        _local_poses(scene, world, q),
        jnp.stack(jnp.broadcast_arrays(*carried)),
    )
    world_frame = jnp.broadcast_to(jnp.eye(3, 4)[..., None], (3, 4, q.shape[-1]))
    poses = jnp.zeros((len(links) + 1, *world_frame.shape)).at[0].set(world_frame)

    def attach(poses: jax.Array, step: tuple[jax.Array, ...]) -> tuple[jax.Array, None]:
        row, parent, local, held = step
        base = jnp.where(held, poses[hand], poses[parent])
        return poses.at[row].set(_compose(base, local)), None

    return jax.lax.scan(attach, poses, steps)[0]


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


def _hand_row(scene: Scene) -> int:
    return scene.structure.link_of[int(scene.mj_model.body(scene.hand).id)]


def _compose(a: jax.Array, b: jax.Array) -> jax.Array:
    """The frame b, given in a, in the world: `[3, 4, B]` each."""
    # Written out, because a batched matrix product is slow on CPU.
    product = sum(a[:, k, None] * b[None, k] for k in range(3))
    last = jnp.array([0.0, 0.0, 0.0, 1.0])[:, None]
    return product + a[:, 3, None] * last


def _local_poses(scene: Scene, world: World, q: jax.Array) -> jax.Array:
    """`[n_links, 3, 4, B]` pose of each link in its parent."""
    links = scene.structure.links
    objects = [link for link in links if link.object >= 0]
    if not objects:
        return _joint_poses(scene, world, q, links)
    first = links.index(objects[0])
    given = world.object_pose[np.array([link.object for link in objects])]
    given = jnp.broadcast_to(given, (*given.shape[:-1], q.shape[-1]))
    rotation = jnp.moveaxis(rotation_of(jnp.moveaxis(given[:, 3:], 1, 0)), 2, 0)
    parts = [
        _joint_poses(scene, world, q, links[:first]),
        jnp.concatenate([rotation, given[:, :3, None]], 2),
        _joint_poses(scene, world, q, links[first + len(objects) :]),
    ]
    return jnp.concatenate(parts)


def _joint_poses(
    scene: Scene, world: World, q: jax.Array, links: tuple[Link, ...]
) -> jax.Array:
    """`[n, 3, 4, B]` pose of links that a joint moves or none, all in one expression."""
    model = scene.model
    body, joint = (np.array([getattr(link, key) for link in links], int)
                   for key in ("body", "joint"))  # fmt: skip
    start = np.array([link.offset for link in links], bool)
    slides = np.array([link.slides for link in links], bool)
    offset = jnp.where(
        start[:, None, None], _matrices(model.body_quat[body]), jnp.eye(3)
    )
    position = jnp.where(start[:, None], model.body_pos[body], 0)
    axis, anchor = model.jnt_axis[joint], model.jnt_pos[joint]
    value = _values(scene, world, q, links)
    angle = jnp.where(slides[:, None], 0, value)[:, None, None]
    # Rodrigues, with the fixed offset multiplied in beforehand.
    zero, (x, y, z) = jnp.zeros(len(links)), axis.T
    cross = jnp.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(-1, 3, 3)
    square = axis[:, :, None] * axis[:, None] - jnp.eye(3)
    rotation = (
        offset[..., None]
        + (offset @ cross)[..., None] * jnp.sin(angle)
        + (offset @ square)[..., None] * (1 - jnp.cos(angle))
    )
    shift = jnp.where(slides[:, None], value, 0)[:, None]
    along = (offset @ axis[..., None]) * shift
    fixed = position + (offset @ anchor[..., None])[..., 0]
    swept = sum(rotation[:, :, k] * anchor[:, None, k, None] for k in range(3))
    return jnp.concatenate(
        [rotation, (fixed[..., None] + along - swept)[:, :, None]], 2
    )


def _matrices(quats: jax.Array) -> jax.Array:
    """`[n, 3, 3]` of `[n, 4]`."""
    return jnp.moveaxis(rotation_of(quats.T), -1, 0)


def _values(
    scene: Scene, world: World, q: jax.Array, links: tuple[Link, ...]
) -> jax.Array:
    """`[n, B]` how far each joint is from its reference; 0 where there is none."""
    address = np.array([scene.mj_model.jnt_qposadr[link.joint] for link in links], int)
    variable = np.array([link.variable for link in links], int)
    passive = jnp.broadcast_to(world.passive, (len(scene.passive), q.shape[-1]))
    values = jnp.concatenate([q, passive])[variable]
    reference = jnp.asarray(scene.model.qpos0)[address]
    return jnp.where(variable[:, None] >= 0, values - reference[:, None], 0)

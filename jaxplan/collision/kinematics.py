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
    links = scene.structure.links
    hand = scene.structure.link_of[scene.body_id(scene.hand)]
    objects = [row for row, link in enumerate(links, 1) if link.object >= 0]
    first, last = (objects[0], objects[-1]) if objects else (len(links) + 1,) * 2
    fixed = jnp.broadcast_to(
        jnp.eye(3, 4, dtype=q.dtype)[..., None], (3, 4, q.shape[-1])
    )
    poses = jnp.zeros((1 + len(links), *fixed.shape), q.dtype).at[0].set(fixed)
    poses = _attach(scene, world, q, poses, range(1, first))
    for row in objects:
        index = links[row - 1].object
        given = world.object_pose[index]
        local = jnp.concatenate([rotation_of(given[3:]), given[:3, None]], 1)
        base = jnp.where(world.held[index], poses[hand], fixed)
        poses = poses.at[row].set(_compose(base, local))
    return _attach(scene, world, q, poses, range(last + 1, len(links) + 1))


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


def _compose(a: jax.Array, b: jax.Array) -> jax.Array:
    """The frame b, given in a, in the world: `[3, 4, B]` each."""
    # Written out, because a batched matrix product is slow on CPU.
    product = sum(a[:, k, None] * b[None, k] for k in range(3))
    last = jnp.array([0.0, 0.0, 0.0, 1.0], a.dtype)[:, None]
    return product + a[:, 3, None] * last


def _attach(
    scene: Scene, world: World, q: jax.Array, poses: jax.Array, rows: range
) -> jax.Array:
    """Fills in the poses of some links, each from its parent's."""
    if not rows:
        return poses
    model, links = scene.model, scene.structure.links[rows.start - 1 : rows.stop - 1]
    body = np.array([link.body for link in links])
    joint = np.array([link.joint for link in links])
    start = np.array([link.offset for link in links])
    slides = np.array([link.slides for link in links])[:, None]
    still = jnp.eye(3, dtype=q.dtype)
    turn = jnp.where(start[:, None, None], _matrices(model.body_quat[body]), still)
    axis, anchor = model.jnt_axis[joint][..., None], model.jnt_pos[joint][..., None]
    middle = jnp.where(start[:, None], model.body_pos[body], 0)[..., None]
    value = _values(scene, world, q, links)
    angle, shift = jnp.where(slides, 0, value), jnp.where(slides, value, 0)
    # Rodrigues: R = turn (1 + sin K + (1 - cos) K^2), about the anchor.
    cross = jnp.cross(axis, still, axisa=1, axisc=1)
    constants = turn, turn @ cross, turn @ cross @ cross, anchor
    steps = (
        jnp.array(rows),
        jnp.array([link.parent for link in links]),
        [constant[..., None] for constant in constants],
        (turn @ anchor + middle)[..., None],
        (turn @ axis)[..., None],
        jnp.sin(angle),
        1 - jnp.cos(angle),
        shift,
    )

    def attach(poses: jax.Array, step: tuple) -> tuple[jax.Array, None]:
        row, parent, (turn, once, twice, anchor), middle, along, sin, versin, far = step
        rotation = turn + once * sin + twice * versin
        swept = sum(rotation[:, k, None] * anchor[k] for k in range(3))
        local = jnp.concatenate([rotation, middle + along * far - swept], 1)
        return poses.at[row].set(_compose(poses[parent], local)), None

    return jax.lax.scan(attach, poses, steps)[0]


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

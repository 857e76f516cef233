"""Forward kinematics with the batch as the last axis.

A loop over the links, and on purpose not unrolled: XLA on CPU fuses an unrolled chain
into whatever uses it and computes the whole arm again for every sphere. The loop's
buffer is a wall that it does not cross.
"""

import math
from functools import reduce
from itertools import groupby
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.world import OWN_AXES, World, batch_shape
from jaxplan.scene import Link, Scene, only_line
from jaxplan.scene.dependent import follow


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
    fixed = jnp.broadcast_to(
        jnp.eye(3, 4, dtype=q.dtype)[..., None], (3, 4, q.shape[-1])
    )
    poses = jnp.zeros((1 + len(links), *fixed.shape), q.dtype).at[0].set(fixed)
    rows = range(1, len(links) + 1)
    for placed, run in groupby(rows, lambda row: links[row - 1].object >= 0):
        if not placed:
            poses = _attach(scene, world, q, poses, [*run])
            continue
        for row in run:
            index = links[row - 1].object
            given = world.object_pose[index]
            local = jnp.concatenate([rotation_of(given[3:]), given[:3, None]], 1)
            hand = scene.structure.link_of[scene.body_id(scene.hand)]
            base = jnp.where(world.held[index], poses[hand], fixed)
            poses = poses.at[row].set(_compose(base, local))
    return poses


def frame_pose(scene: Scene, world: World, q: jax.Array, body: str) -> jax.Array:
    """Pose of any body of the model, whether collision needs it or not.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad or m].
        body: Its name.

    Returns:
        `[..., 3, 4]` rotation and position [m] in the world.

    Raises:
        ValueError: There is no such body, or it hangs on a ball joint.
    """
    scene, world, q = in_float32((scene, world, q))
    shape = batch_shape(world, q)

    def flat(leaf: jax.Array, own: int) -> jax.Array:
        tail = leaf.shape[leaf.ndim - own :]
        rows = jnp.broadcast_to(leaf, (*shape, *tail)).reshape(math.prod(shape), *tail)
        return jnp.moveaxis(rows, 0, -1)

    leaves = World(*map(flat, world, OWN_AXES))
    line = _line(scene, body)
    poses = link_poses(line, leaves, flat(q, 1))
    pose = poses[line.structure.link_of[scene.body_id(body)]]
    return jnp.moveaxis(pose, -1, 0).reshape(*shape, 3, 4)


def frame_jacobian(
    scene: Scene, world: World, q: jax.Array, body: str
) -> tuple[jax.Array, jax.Array]:
    """A body's pose, and how the arm's joints move it.

    Args:
        scene: The scene.
        world: Leaves with the batch last, as for `link_poses`.
        q: `[d, B]` joints [rad or m].
        body: Its name; nothing that the hand may hold.

    Returns:
        `[3, 4, B]` as `frame_pose`; `[6, d, B]` the velocity of the body's origin and its
        angular velocity, in the world, by that of each joint (as `mj_jacBody`).
    """
    line, model = _line(scene, body), scene.model
    above = scene.line(scene.body_id(body))
    every = [
        (row, link)
        for row, link in enumerate(line.structure.links, 1)
        if link.joint >= 0 and link.body in above
    ]
    rows, links = zip(*every, strict=True)
    joint = np.array([link.joint for link in links])
    slides = np.array([link.slides for link in links])[:, None, None]
    poses = link_poses(line, world, q)
    pose = poses[line.structure.link_of[scene.body_id(body)]]
    moved = poses[np.array(rows)]
    axis, anchor = (
        sum(moved[:, :, k] * vectors[joint, k, None, None] for k in range(3))
        for vectors in (model.jnt_axis, model.jnt_pos)
    )
    lever = pose[:, 3] - anchor - moved[:, :, 3]
    linear = jnp.where(slides, axis, jnp.cross(axis, lever, axis=1))
    motion = jnp.concatenate([linear, jnp.where(slides, 0, axis)], 1)

    def speeds(direction: jax.Array) -> jax.Array:
        along = jnp.broadcast_to(direction[:, None], q.shape)
        return jax.jvp(lambda q: _values(line, world, q, links), (q,), (along,))[1]

    speed = jax.vmap(speeds)(jnp.eye(len(q), dtype=q.dtype))
    return pose, reduce(
        jnp.add, (speed[:, i] * motion[i, :, None] for i in range(len(links)))
    )


def in_float32(tree: Any) -> Any:
    """The arrays of a pytree in float32, whatever the caller computes in; flags stay."""

    def cast(leaf: jax.typing.ArrayLike) -> jax.Array:
        leaf = jnp.asarray(leaf)
        return leaf if leaf.dtype == bool else leaf.astype(jnp.float32)

    return jax.tree.map(cast, tree)


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
    scene: Scene, world: World, q: jax.Array, poses: jax.Array, rows: list[int]
) -> jax.Array:
    """Fills in the poses of some links, each from its parent's."""
    model = scene.model
    links = tuple(scene.structure.links[row - 1] for row in rows)
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


def joints_moved(scene: Scene, world: World, q: jax.Array) -> jax.Array:
    """`[n, B]` how far all joints that move are from their references.

    Args:
        scene: The scene.
        world: Leaves with the batch last.
        q: `[d, B]` joints [rad or m].
    """
    passive = jnp.broadcast_to(world.passive, (len(scene.passive), q.shape[-1]))
    address = scene.addresses((*scene.joints, *scene.passive))
    reference = jnp.asarray(scene.model.qpos0)[address]
    moved = jnp.concatenate([q, passive]) - reference[:, None]
    dependent = scene.structure.dependent
    return jnp.stack(follow(dependent, moved)) if dependent else moved


def _values(
    scene: Scene, world: World, q: jax.Array, links: tuple[Link, ...]
) -> jax.Array:
    """`[n, B]` how far each joint is from its reference; 0 where there is none."""
    variable = np.array([link.variable for link in links], int)
    moved = joints_moved(scene, world, q)
    return jnp.where(variable[:, None] >= 0, moved[variable], 0)


def _line(scene: Scene, body: str) -> Scene:
    """The scene with the links of one body's line only."""
    return Scene(scene.model, only_line(scene.structure, scene.body_id(body)))

"""The reference backend: `mjx.kinematics` and `mjx.collision`, any geoms that MJX has.

Slow (DESIGN: 400 to 40,000 configurations/s); it is here to check the fast one, and
for pairs of kinds that the fast one lacks.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision.world import World, object_address
from jaxplan.scene import Scene
from jaxplan.scene.dependent import follow
from jaxplan.scene.quiet_mjx import mjx


def least_distances(
    scene: Scene, world: World, q: jax.Array, margins: jax.Array | None = None
) -> jax.Array:
    """Least signed distance over all pairs that count.

    Args:
        scene: The scene.
        world: Leaves with the batch last, `[..., N]` or `[..., 1]`.
        q: `[d, N]` joints.
        margins: `[ngeom, ngeom]` of each pair, subtracted [m].

    Returns:
        `[N]` [m].
    """
    if scene.slots or scene.mocap or scene.shaped:
        raise ValueError(
            "backend 'mjx' has no slots, mocap bodies or shaped objects; use 'fast'"
        )
    if not scene.groups:
        return jnp.full(q.shape[-1], jnp.inf)
    model = mjx.put_model(scene.mj_model).replace(**scene.model._asdict())
    empty = mjx.make_data(scene.mj_model)
    groups = jnp.asarray(scene.group_table())

    def one(q: jax.Array, world: World) -> jax.Array:
        data = mjx.kinematics(model, empty.replace(qpos=_qpos(scene, world, q)))
        hand = scene.body_id(scene.hand)
        held = _held_poses(world, data.xpos[hand], data.xquat[hand])
        moved = world._replace(object_pose=held)
        data = data.replace(qpos=_qpos(scene, moved, q))
        data = mjx.collision(model, mjx.kinematics(model, data))
        contact = data._impl.contact
        counts = [
            ~world.ignored[i] & (world.held[np.array(g.held, int)].any() | (not g.held))
            for i, g in enumerate(scene.groups)
        ]
        counts = jnp.stack([*counts, jnp.array(False)])
        index = groups[contact.geom[:, 0], contact.geom[:, 1]]
        distance = contact.dist
        if margins is not None:
            distance -= margins[contact.geom[:, 0], contact.geom[:, 1]]
        return jnp.min(jnp.where(counts[index], distance, jnp.inf))

    shared: list[Any] = [None if leaf.shape[-1] == 1 else -1 for leaf in world]
    axes = World(*shared)
    own = [x[..., 0] if a is None else x for a, x in zip(axes, world, strict=True)]
    return jax.vmap(one, (-1, axes))(q, World(*own))


def _qpos(scene: Scene, world: World, q: jax.Array) -> jax.Array:
    qpos = jnp.asarray(scene.model.qpos0)
    address = scene.mj_model.jnt_qposadr[[*scene.structure.variables]]
    given = jnp.concatenate([q, world.passive])
    moved = given - qpos[address[: len(given)]]
    moved = jnp.stack(follow(scene.structure.dependent, moved))
    qpos = qpos.at[address].add(moved)
    for i, name in enumerate(scene.objects):
        start = object_address(scene, name)
        qpos = qpos.at[start : start + 7].set(world.object_pose[i])
    return qpos


def _held_poses(world: World, position: jax.Array, quat: jax.Array) -> jax.Array:
    """Poses in the world; held objects' are given in the hand's frame."""
    given = world.object_pose
    w, v = quat[0], quat[1:]
    ow, ov = given[:, 3:4], given[:, 4:]
    turned = given[:, :3] + 2 * jnp.cross(
        v, jnp.cross(v, given[:, :3]) + w * given[:, :3]
    )
    product = jnp.concatenate(
        [w * ow - ov @ v[:, None], w * ov + ow * v + jnp.cross(v, ov)], -1
    )
    carried = jnp.concatenate([position + turned, product], -1)
    return jnp.where(world.held[:, None], carried, given)

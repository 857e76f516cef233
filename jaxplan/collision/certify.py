"""C MuJoCo's answer to the same questions: the oracle, and the last word on a path."""

import copy
import math
from collections.abc import Iterator
from typing import NamedTuple

import jax
import mujoco
import numpy as np

from jaxplan.collision.world import World, batch_shape, object_address
from jaxplan.scene import Scene


class Certificate(NamedTuple):
    """What C MuJoCo says about a path."""

    valid: bool
    """No contact that counts is deeper than the tolerance."""
    clearance: float
    """Least signed distance on the path [m], negative = penetration; inf if no contact."""
    pair: tuple[str, str] | None
    """The geoms of the deepest contact, by name."""
    where: float
    """Its place: 2.25 is a quarter of the way from waypoint 2 to waypoint 3."""
    q: np.ndarray | None
    """`[d]` its joints."""


def certify(
    scene: Scene,
    world: World,
    path: jax.typing.ArrayLike,
    resolution: float = 0.01,
    tolerance: float = 0.001,
) -> Certificate:
    """Checks a piecewise linear path densely.

    Args:
        scene: The scene.
        world: One world, without batch axes.
        path: `[n, d]` waypoints [rad].
        resolution: Longest gap between checked configurations [rad].
        tolerance: Penetration that still passes [m].
    """
    places, rows = _densify(np.asarray(path, float), resolution)
    if not np.isfinite(rows).all():
        return Certificate(False, math.nan, None, math.nan, None)
    best = Certificate(True, math.inf, None, 0.0, None)
    answers = _nearest(scene, jax.tree.map(np.asarray, world), rows, reach=0.0)
    for place, q, (distance, pair) in zip(places, rows, answers, strict=True):
        if distance < best.clearance:
            valid = bool(distance >= -tolerance)
            best = Certificate(valid, distance, pair, float(place), q)
    return best


def closest_pair(
    scene: Scene, world: World, q: jax.typing.ArrayLike, reach: float = 0.1
) -> tuple[tuple[str, str] | None, float]:
    """The pair of geoms that is nearest to each other, by name, and its distance [m].

    Args:
        scene: The scene.
        world: One world, without batch axes.
        q: `[d]` joints [rad].
        reach: Pairs farther apart than this are not looked for [m]; (None, inf) then.
    """
    rows = np.asarray(q, float)[None]
    distance, pair = next(_nearest(scene, jax.tree.map(np.asarray, world), rows, reach))
    return pair, distance


def clearance_mujoco(
    scene: Scene, world: World, q: jax.typing.ArrayLike, reach: float = 0.05
) -> np.ndarray:
    """As `clearance`, by C MuJoCo; distances beyond `reach` come out as inf.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        reach: How far pairs are looked for [m].
    """
    q = np.asarray(q, float)
    shape = batch_shape(world, q)
    rows = np.broadcast_to(q, (*shape, q.shape[-1])).reshape(-1, q.shape[-1])
    worlds = World(
        *(
            np.broadcast_to(leaf, (*shape, *leaf.shape[leaf.ndim - own :])).reshape(
                -1, *leaf.shape[leaf.ndim - own :]
            )
            for leaf, own in zip(map(np.asarray, world), (2, 1, 1, 1), strict=True)
        )
    )
    answers = _nearest(scene, worlds, rows, reach)
    return np.array([distance for distance, _ in answers]).reshape(shape)


def mujoco_model(scene: Scene, reach: float = 0.0) -> mujoco.MjModel:
    """The C model with the scene's numbers, which reports contacts within `reach` [m]."""
    model = copy.copy(scene.mj_model)
    fields = "geom_pos geom_quat geom_size body_pos body_quat jnt_pos jnt_axis qpos0"
    for field in fields.split():
        getattr(model, field)[:] = np.asarray(getattr(scene.model, field))
    # Bounds of the broad phase follow from the sizes; the tree of bounds in a body does
    # not follow at all, so it is left out.
    half = model.geom_size.copy()
    sphere = model.geom_type == mujoco.mjtGeom.mjGEOM_SPHERE
    capsule = model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE
    half[sphere] = half[sphere, :1]
    half[capsule] = half[capsule][:, [0, 0, 0]] + half[capsule][:, [1]] * [0, 0, 1]
    known = sphere | capsule | (model.geom_type == mujoco.mjtGeom.mjGEOM_BOX)
    model.geom_aabb[known] = np.concatenate([0 * half, half], -1)[known]
    bound = np.where(capsule, half[:, 2], np.linalg.norm(half, axis=-1))
    model.geom_rbound[known] = np.where(sphere, half[:, 0], bound)[known]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    model.geom_margin[:] = reach
    model.body_margin[:] = reach
    return model


def set_state(
    scene: Scene,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    world: World,
    q: np.ndarray,
) -> None:
    """Puts one configuration into C MuJoCo and runs its kinematics and collision."""
    for name, value in zip(scene.joints, q, strict=True):
        data.qpos[model.joint(name).qposadr] = value
    for name, value in zip(scene.passive, world.passive, strict=True):
        data.qpos[model.joint(name).qposadr] = value
    for name, pose in zip(scene.objects, world.object_pose, strict=True):
        start = object_address(scene, name)
        data.qpos[start : start + 7] = pose
    mujoco.mj_kinematics(model, data)
    if world.held.any():
        hand = data.body(scene.hand)
        for name, pose in zip(
            np.array(scene.objects)[world.held],
            world.object_pose[world.held],
            strict=True,
        ):
            start = object_address(scene, name)
            target = data.qpos[start : start + 7]
            mujoco.mju_mulPose(
                target[:3], target[3:], hand.xpos, hand.xquat, pose[:3], pose[3:]
            )
        mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)


def _nearest(
    scene: Scene, worlds: World, rows: np.ndarray, reach: float
) -> Iterator[tuple[float, tuple[str, str] | None]]:
    """Least distance and its pair for each row; worlds have a row axis or none."""
    model = mujoco_model(scene, reach)
    data = mujoco.MjData(model)
    groups = scene.group_table()
    shared = worlds.held.ndim == 1
    for index, q in enumerate(rows):
        world = worlds if shared else World(*(leaf[index] for leaf in worlds))
        set_state(scene, model, data, world, q)
        allowed = [
            world.ignored[i] or (bool(g.held) and not world.held[list(g.held)].any())
            for i, g in enumerate(scene.groups)
        ]
        # Contacts outside of all groups (a static body on another) get number -1.
        allowed = np.array([*allowed, True])
        geoms = data.contact.geom
        distance = np.where(
            allowed[groups[geoms[:, 0], geoms[:, 1]]], np.inf, data.contact.dist
        )
        if not np.isfinite(distance).any():
            yield math.inf, None
            continue
        deepest = distance.argmin()
        first, second = (scene.geom_name(int(g)) for g in geoms[deepest])
        yield float(distance[deepest]), (first, second)


def _densify(path: np.ndarray, resolution: float) -> tuple[np.ndarray, np.ndarray]:
    """Places on the path no more than `resolution` apart, and their joints."""
    places = [np.zeros(1)]
    for i, step in enumerate(np.linalg.norm(np.diff(path, axis=0), axis=-1)):
        count = max(1, math.ceil(step / resolution)) if np.isfinite(step) else 1
        places.append(i + (np.arange(count) + 1) / count)
    where = np.concatenate(places)
    waypoints = np.arange(len(path))
    rows = np.stack([np.interp(where, waypoints, joint) for joint in path.T], -1)
    return where, rows

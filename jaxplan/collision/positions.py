"""MuJoCo's joint positions for the arm's joints and a world."""

import mujoco
import numpy as np

from jaxplan.collision.world import World, object_address
from jaxplan.scene import Scene
from jaxplan.scene.dependent import follow


def qpos_rows(scene: Scene, worlds: World, q: np.ndarray) -> np.ndarray:
    """`[n, nq]` MuJoCo's joint positions; a held object's pose is still the hand's.

    Args:
        scene: The scene.
        worlds: Leaves `[n, ...]`, NumPy.
        q: `[n, d]` joints.
    """
    qpos = np.tile(np.asarray(scene.model.qpos0, float), (len(q), 1))
    for names, values in ((scene.joints, q), (scene.passive, worlds.passive)):
        qpos[:, scene.addresses(names)] = values
    couple(scene, qpos)
    for index, name in enumerate(scene.objects[: free_objects(scene)]):
        start = object_address(scene, name)
        qpos[:, start : start + 7] = worlds.object_pose[:, index]
    return qpos


def couple(scene: Scene, qpos: np.ndarray) -> None:
    """Sets the dependent joints to where their masters put them, in `qpos [n, nq]`."""
    dependent, ids = scene.structure.dependent, [*scene.structure.variables]
    address = scene.mj_model.jnt_qposadr[ids]
    reference = np.asarray(scene.model.qpos0, float)[address]
    free = len(ids) - len(dependent)
    moved = follow(dependent, (qpos[:, address] - reference)[:, :free].T)
    for column, zero, value in [*zip(address, reference, moved, strict=True)][free:]:
        qpos[:, column] = zero + value


def carry(scene: Scene, data: mujoco.MjData, held: np.ndarray) -> None:
    """Turns held objects' poses from the hand's frame to the world, in `data.qpos`.

    Args:
        scene: The scene.
        data: After `mj_kinematics`.
        held: `[n_objects]` bool.
    """
    hand = data.body(scene.body_id(scene.hand))
    for name in np.array(scene.objects)[held]:
        start = object_address(scene, name)
        pose = data.qpos[start : start + 7]
        mujoco.mju_mulPose(
            pose[:3], pose[3:], hand.xpos, hand.xquat, pose[:3].copy(), pose[3:].copy()
        )


def free_objects(scene: Scene) -> int:
    """How many of the objects have a free joint: the first ones, before mocap bodies."""
    return len(scene.objects) - len(scene.mocap)

"""C MuJoCo's model with a scene's numbers, set up to report contacts and nothing else."""

import copy

import mujoco
import numpy as np

from jaxplan.collision.world import World
from jaxplan.scene import Scene
from jaxplan.scene.contacts import KINDS


def mujoco_model(scene: Scene) -> mujoco.MjModel:
    """The C model with the scene's numbers; it reports contacts at distance 0."""
    model = copy.copy(scene.mj_model)
    fields = "geom_pos geom_quat geom_size body_pos body_quat jnt_pos jnt_axis qpos0"
    for field in fields.split():
        getattr(model, field)[:] = np.asarray(getattr(scene.model, field))
    model.geom_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    _bound(model)
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_MIDPHASE
    model.opt.disableflags &= ~(flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT)
    model.opt.enableflags = 0
    # Flexes that are in the scene touch nothing that counts, and are in no contact's geoms.
    for bits in (model.flex_contype, model.flex_conaffinity, model.flex_selfcollide):
        bits[:] = 0
    model.geom_gap[:] = model.pair_gap[:] = 0
    look_within(model, 0.0)
    return model


def look_within(model: mujoco.MjModel, reach: float) -> None:
    """Lets the collision pipeline report pairs up to `reach` apart [m]."""
    model.geom_margin[:] = reach / 2  # two of them add up
    model.body_margin[:] = model.pair_margin[:] = reach


def fill(scene: Scene, model: mujoco.MjModel, world: World) -> None:
    """Puts a world's obstacles into the model's slots, and gives shaped objects its shape."""
    geoms, pose = [slot.geom for slot in scene.slots], np.asarray(world.slot_pose)
    model.geom_pos[geoms], model.geom_size[geoms] = pose[:, :3], world.slot_size
    norm = np.linalg.norm(pose[:, 3:], axis=-1, keepdims=True)
    model.geom_quat[geoms] = pose[:, 3:] / norm
    shaped = list(scene.shaped)
    model.geom_pos[shaped], model.geom_size[shaped] = world.geom_pos, world.geom_size
    _bound(model)


def _bound(model: mujoco.MjModel) -> None:
    """Bounds of the broad phase, anew from the sizes.

    The tree of bounds in a body does not follow at all, so it is left out.
    """
    kind = {name: model.geom_type == code for code, name in KINDS.items()}
    half = model.geom_size.copy()
    half[kind["sphere"]] = half[kind["sphere"], :1]
    round_ = kind["capsule"] | kind["cylinder"]
    caps = np.where(kind["capsule"], half[:, 0], 0)[round_]
    half[round_, 2], half[round_, 1] = half[round_, 1] + caps, half[round_, 0]
    known = kind["sphere"] | kind["box"] | kind["ellipsoid"] | round_
    model.geom_aabb[known] = np.concatenate([0 * half, half], -1)[known]
    bound = np.linalg.norm(half, axis=-1)
    bound = np.where(kind["capsule"], half[:, 2], bound)
    bound = np.where(kind["sphere"] | kind["ellipsoid"], half.max(-1), bound)
    model.geom_rbound[known] = bound[known]

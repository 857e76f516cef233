"""C MuJoCo's answer to the same questions: the oracle."""

import copy
import math
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from jaxplan.collision.checks import checked
from jaxplan.collision.positions import carry, free_objects, qpos_rows
from jaxplan.collision.world import OWN_AXES, World, batch_shape
from jaxplan.ranges import NotNegative, check
from jaxplan.scene import Scene
from jaxplan.scene.contacts import KINDS

PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
ITERATED = [
    code for code, name in KINDS.items() if name in ("ellipsoid", "cylinder", "mesh")
]


def closest_pair(
    scene: Scene, world: World, q: npt.ArrayLike, reach: float = 0.1
) -> tuple[tuple[str, str] | None, float]:
    """The pair of geoms that is nearest to each other, by name, and its distance [m].

    Args:
        scene: The scene.
        world: One world, without batch axes.
        q: `[d]` joints [rad].
        reach: Pairs farther apart than this are not looked for [m]; (None, inf) then.
    """
    world, q = checked(scene, world, q=q)
    check("reach", reach, NotNegative)
    rows = np.asarray(q, float)[None]
    distance, geoms = next(nearest(scene, world, rows, reach))
    return names_of(scene, geoms), distance


def clearance_mujoco(
    scene: Scene, world: World, q: npt.ArrayLike, reach: float = 0.05
) -> np.ndarray:
    """As `clearance`, by C MuJoCo; distances beyond `reach` come out as inf.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        reach: How far pairs are looked for [m].
    """
    world, q = checked(scene, world, q=q)
    check("reach", reach, NotNegative)
    q = np.asarray(q, float)
    shape = batch_shape(world, q)
    rows = np.broadcast_to(q, (*shape, q.shape[-1])).reshape(-1, q.shape[-1])
    answers = nearest(scene, _rows(world, shape), rows, reach)
    return np.array([distance for distance, _ in answers]).reshape(shape)


def mujoco_model(scene: Scene, reach: float = 0.0) -> mujoco.MjModel:
    """The C model with the scene's numbers, which reports contacts within `reach` [m]."""
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
    for margin in _margins(model):
        margin[:] = reach
    model.geom_gap[:] = model.pair_gap[:] = 0
    return model


def _margins(model: mujoco.MjModel) -> tuple[np.ndarray, ...]:
    """Every margin that the collision pipeline adds up, to be written into."""
    return model.geom_margin, model.body_margin, model.pair_margin


def fill_slots(
    scene: Scene, model: mujoco.MjModel, pose: np.ndarray, size: np.ndarray
) -> None:
    """Puts obstacles `pose [n_slots, 7]`, `size [n_slots, 3]` into the model's slots."""
    geoms = [slot.geom for slot in scene.slots]
    model.geom_pos[geoms], model.geom_size[geoms] = pose[:, :3], size
    norm = np.linalg.norm(pose[:, 3:], axis=-1, keepdims=True)
    model.geom_quat[geoms] = pose[:, 3:] / norm
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


def contacts_of(
    scene: Scene, world: World, rows: np.ndarray, reach: float = 0.0
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """All contacts that count, configuration by configuration.

    Args:
        scene: The scene.
        world: One for all, or leaves `[n, ...]`.
        rows: `[n, d]` joints.
        reach: How far pairs are looked for [m].

    Yields:
        Distances `[k]` [m] and geoms `[k, 2]`.
    """
    worlds = _rows(world, (len(rows),))
    model = mujoco_model(scene, reach)
    data = mujoco.MjData(model)
    table = scene.group_table()
    # Contacts that are in no group (-1: a static body on another) count for nothing.
    silent = np.pad(worlds.ignored, ((0, 0), (0, 1)), constant_values=True)
    for index, group in enumerate(scene.groups):
        if group.held:
            silent[:, index] |= ~worlds.held[:, list(group.held)].any(-1)
    qpos = qpos_rows(scene, worlds, rows)
    mocap = model.body_mocapid[[scene.body_id(name) for name in scene.mocap]]
    placed = worlds.object_pose[:, free_objects(scene) :]
    slots = np.asarray(worlds.slot_pose), np.asarray(worlds.slot_size)
    for i in range(len(rows)):
        if scene.slots and (i == 0 or any((x[i] != x[i - 1]).any() for x in slots)):
            fill_slots(scene, model, *(x[i] for x in slots))
        data.qpos[:] = qpos[i]
        data.mocap_pos[mocap] = placed[i, :, :3]
        data.mocap_quat[mocap] = placed[i, :, 3:]
        mujoco.mj_kinematics(model, data)
        if worlds.held[i].any():
            carry(scene, data, np.asarray(worlds.held[i]))
            mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        geoms = data.contact.geom
        counts = ~silent[i, table[geoms[:, 0], geoms[:, 1]]]
        geoms, distance = geoms[counts], data.contact.dist[counts]
        _measure(model, data, geoms, distance)
        if reach > 0 and (distance <= 0).any():
            _doubt(model, data, geoms, distance)
        near = distance <= reach
        yield distance[near], geoms[near]


def _measure(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: np.ndarray, distance: np.ndarray
) -> None:
    """Corrects, in place, distances `[k]` of `geoms [k, 2]` that have no closed form.

    `mj_collision` finds all pairs within the margin, but takes the distance of such a pair
    from the depth of geoms blown up by it: centimetres off for a capsule near a cylinder,
    and millimetres where they touch. `mj_geomDistance` measures the geoms themselves.
    """
    kinds = model.geom_type[geoms]
    for row in np.flatnonzero(
        np.isin(kinds, ITERATED).any(-1) & (kinds != PLANE).all(-1)
    ):
        i, j = map(int, geoms[row])
        far = max(1.0, 2 * distance[row])
        distance[row] = mujoco.mj_geomDistance(model, data, i, j, far, None)


def _doubt(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: np.ndarray, distance: np.ndarray
) -> None:
    """Sets to just above 0, in place, distances of geoms that `mj_collision` sees apart.

    `mj_geomDistance` lets some meshes overlap that are not even near: Kinova's Jaco, base
    and upper arm, 21 mm deep where they are 33 mm apart. Without a margin the verdict of
    `mj_collision`, which physics uses, is right about them.
    """
    kept = [margin.copy() for margin in _margins(model)]
    for margin in _margins(model):
        margin[:] = 0
    mujoco.mj_collision(model, data)
    for margin, own in zip(_margins(model), kept, strict=True):
        margin[:] = own
    touching = {frozenset(pair) for pair in data.contact.geom.tolist()}
    for row in np.flatnonzero(distance <= 0):
        if frozenset(geoms[row].tolist()) not in touching:
            distance[row] = np.finfo(float).tiny


def nearest(
    scene: Scene, world: World, rows: np.ndarray, reach: float
) -> Iterator[tuple[float, tuple[int, int] | None]]:
    """Least distance of each row and its geoms; see `contacts_of`."""
    for distance, geoms in contacts_of(scene, world, rows, reach):
        if len(distance):
            deepest = int(distance.argmin())
            i, j = map(int, geoms[deepest])
            yield float(distance[deepest]), (i, j)
        else:
            yield math.inf, None


def names_of(scene: Scene, geoms: tuple[int, int] | None) -> tuple[str, str] | None:
    """Both geoms by name."""
    return geoms and (scene.geom_name(geoms[0]), scene.geom_name(geoms[1]))


def _rows(world: World, shape: tuple[int, ...]) -> World:
    """The world's leaves as `[n, ...]` NumPy arrays, n = size of the shape."""

    def one(leaf: Any, own: Any) -> Any:
        tail = leaf.shape[leaf.ndim - own :]
        rows = np.broadcast_to(np.asarray(leaf), (*shape, *tail))
        return rows.reshape(math.prod(shape), *tail)

    return World(*(one(*pair) for pair in zip(world, OWN_AXES, strict=True)))

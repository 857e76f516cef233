"""What changes between queries: where things are, what is held, what may touch."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt
from jax.core import Tracer

from jaxplan.collision.obstacles import Obstacle, fill
from jaxplan.process import refuse_fork
from jaxplan.ranges import check
from jaxplan.scene import Scene
from jaxplan.scene.names import known, shortened
from jaxplan.scene.numbers import rotations


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
    """`[..., n_passive]` positions of the joints that are not the arm's (fingers) and
    follow none [rad or m]."""
    ignored: jax.Array
    """`[..., n_groups]` bool: contacts that this phase allows (`Scene.ignored`)."""
    slot_pose: jax.Array
    """`[..., n_slots, 7]` of the obstacles in the scene's slots."""
    slot_size: jax.Array
    """`[..., n_slots, 3]` their sizes as MuJoCo's [m]."""
    geom_pos: jax.Array
    """`[..., n_shaped, 3]` where the geoms of shaped objects are (`Scene.shaped`), in the
    frames of their bodies [m]."""
    geom_size: jax.Array
    """`[..., n_shaped, 3]` their sizes as MuJoCo's [m]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is in NumPy: so it can be read without JAX."""
        return World, tuple(map(np.asarray, self))


OWN_AXES = (2, 1, 1, 1, 2, 2, 2, 2)
"""How many of each leaf's axes are not batch axes."""


def make_world(
    scene: Scene,
    object_pose: npt.ArrayLike | None = None,
    held: npt.ArrayLike | None = None,
    passive: npt.ArrayLike | None = None,
    ignored: Iterable[str | tuple[str, str]] = (),
    obstacles: Iterable[Obstacle] = (),
    geom_pos: npt.ArrayLike | None = None,
    geom_size: npt.ArrayLike | None = None,
) -> World:
    """A world; what is not given is as in the model's reference pose.

    Args:
        scene: The scene.
        object_pose: `[..., n_objects, 7]`, see `World`.
        held: `[..., n_objects]` bool; none by default.
        passive: `[..., n_passive]` [rad or m].
        ignored: Pairs of bodies that may touch, "hand|cup" or ("hand", "cup").
        obstacles: What fills the scene's slots, at most as many of a kind as there are.
        geom_pos: `[..., n_shaped, 3]` [m], see `World`.
        geom_size: `[..., n_shaped, 3]` [m].

    Raises:
        ValueError: There is no slot of that kind left, or no such pair; an obstacle makes
            no sense; an array has the wrong shape; what is held is a mocap body, or the
            arm hangs on it.
    """
    refuse_fork()
    check("scene", scene, Scene)
    if object_pose is None:
        poses = [_reference_pose(scene, name) for name in scene.objects]
        object_pose = np.array(poses).reshape(-1, 7)
    if held is None:
        held = np.zeros(len(scene.objects), bool)
    if passive is None:
        passive = scene.mj_model.qpos0[scene.addresses(scene.passive)]
    rows = np.array(scene.shaped, int)
    if geom_pos is None:
        geom_pos = jnp.asarray(scene.model.geom_pos)[rows]
    if geom_size is None:
        geom_size = jnp.asarray(scene.model.geom_size)[rows]
    world = World(
        jnp.asarray(object_pose, jnp.float32),
        jnp.asarray(held, bool),
        jnp.asarray(passive, jnp.float32),
        jnp.asarray(scene.ignored(ignored)),
        *fill(scene, obstacles),
        jnp.asarray(geom_pos, jnp.float32),
        jnp.asarray(geom_size, jnp.float32),
    )
    _refuse_shapes(scene, world)
    if not isinstance(world.held, Tracer):
        _refuse_held(scene, np.asarray(world.held))
    return world


def world_at(
    scene: Scene, qpos: np.ndarray, mocap: npt.ArrayLike | None = None
) -> World:
    """A world with passive joints and objects where MuJoCo has them.

    Args:
        scene: The scene.
        qpos: `[nq]` MuJoCo's joint positions.
        mocap: `[nmocap, 7]` poses of the mocap bodies, by mocap id; the model's where None.
    """
    poses = []
    for name in scene.objects:
        if name not in scene.mocap:
            start = object_address(scene, name)
            poses.append(qpos[start : start + 7])
        elif mocap is None:
            poses.append(_reference_pose(scene, name))
        else:
            own = scene.mj_model.body_mocapid[scene.body_id(name)]
            poses.append(np.asarray(mocap, float)[own])
    pose = np.array(poses, float).reshape(-1, 7)
    pose[:, 3:] = rotations(pose[:, 3:])
    return make_world(scene, pose, passive=qpos[scene.addresses(scene.passive)])


def world_at_key(scene: Scene, key: str | int) -> World:
    """A world as in a key frame of the model, its mocap bodies included.

    Args:
        scene: The scene.
        key: Its name or id.

    Raises:
        ValueError: There is no such key frame.
    """
    model = scene.mj_model
    names = [model.key(i).name for i in range(model.nkey)]
    if isinstance(key, str):
        key = names.index(known(key, "key frame", names))
    elif not 0 <= key < model.nkey:
        raise ValueError(f"no key frame {key}: the model has {model.nkey}")
    poses = (model.key_mpos[key].reshape(-1, 3), model.key_mquat[key].reshape(-1, 4))
    return world_at(scene, model.key_qpos[key], np.concatenate(poses, -1))


def _refuse_shapes(scene: Scene, world: World) -> None:
    """Names an array that does not fit the scene, and what its rows are for."""
    shaped = [scene.geom_name(geom) for geom in scene.shaped]
    expected = (
        ("object_pose", world.object_pose, scene.objects, (7,)),
        ("held", world.held, scene.objects, ()),
        ("passive", world.passive, scene.passive, ()),
        ("geom_pos", world.geom_pos, shaped, (3,)),
        ("geom_size", world.geom_size, shaped, (3,)),
    )
    for field, leaf, names, row in expected:
        own = (len(names), *row)
        if leaf.shape[-len(own) :] != own:
            wanted = ", ".join(map(str, ("...", *own)))
            raise ValueError(
                f"{field} has shape {leaf.shape}, expected [{wanted}] for "
                f"{shortened(names) if names else 'nothing'}"
            )


def _refuse_held(scene: Scene, held: np.ndarray) -> None:
    """Names what cannot be in the hand."""
    for name, taken in zip(scene.objects, np.moveaxis(held, -1, 0), strict=True):
        if not taken.any():
            continue
        if name in scene.mocap:
            raise ValueError(
                f"mocap bodies cannot be held, they have no free joint: {name}"
            )
        if name in scene.bases:
            raise ValueError(f"{name!r} cannot be held, the arm hangs on it")


def batch_shape(world: World, q: jax.Array | np.ndarray) -> tuple[int, ...]:
    """Common leading shape of the world's leaves and of q `[..., d]`."""
    leaves = zip(world, OWN_AXES, strict=True)
    shapes = [leaf.shape[: leaf.ndim - own] for leaf, own in leaves]
    return jnp.broadcast_shapes(q.shape[:-1], *shapes)


def object_address(scene: Scene, name: str) -> int:
    """Where the object's free joint starts in qpos."""
    model = scene.mj_model
    return int(model.jnt_qposadr[model.body_jntadr[scene.body_id(name)]])


def _reference_pose(scene: Scene, name: str) -> np.ndarray:
    """`[7]` of a movable object, as the model has it."""
    model, body = scene.mj_model, scene.body_id(name)
    if name in scene.mocap:
        pose = np.concatenate([model.body_pos[body], model.body_quat[body]])
    else:
        start = object_address(scene, name)
        pose = model.qpos0[start : start + 7]
    return np.concatenate([pose[:3], rotations(pose[3:])])

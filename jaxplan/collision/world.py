"""What changes between queries: where things are, what is held, what may touch."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpy.typing as npt

from jaxplan.process import refuse_fork
from jaxplan.ranges import check
from jaxplan.scene import Scene

SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
"""Numbers that give an obstacle's size."""
FAR = (0.0, 0.0, 1000.0, 1.0, 0.0, 0.0, 0.0)
"""Where an empty slot is: out of reach of everything."""


class Obstacle(NamedTuple):
    """Something that fills a slot."""

    kind: str
    """sphere, capsule, cylinder, ellipsoid or box."""
    size: Sequence[float]
    """As MuJoCo's: radius; radius and half length; half sides or semi-axes [m]."""
    pose: Sequence[float]
    """`[7]` position [m] and quaternion (w, x, y, z); a position alone is enough."""


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
    """`[..., n_passive]` positions of the joints that are not the arm's (fingers) [m]."""
    ignored: jax.Array
    """`[..., n_groups]` bool: contacts that this phase allows (`Scene.ignored`)."""
    slot_pose: jax.Array
    """`[..., n_slots, 7]` of the obstacles in the scene's slots."""
    slot_size: jax.Array
    """`[..., n_slots, 3]` their sizes as MuJoCo's [m]."""

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is in NumPy: so it can be read without JAX."""
        return World, tuple(map(np.asarray, self))


OWN_AXES = (2, 1, 1, 1, 2, 2)
"""How many of each leaf's axes are not batch axes."""


def make_world(
    scene: Scene,
    object_pose: npt.ArrayLike | None = None,
    held: npt.ArrayLike | None = None,
    passive: npt.ArrayLike | None = None,
    ignored: Iterable[str] = (),
    obstacles: Iterable[Obstacle] = (),
) -> World:
    """A world; what is not given is as in the model's reference pose.

    Args:
        scene: The scene.
        object_pose: `[..., n_objects, 7]`, see `World`.
        held: `[..., n_objects]` bool; none by default.
        passive: `[..., n_passive]` [m].
        ignored: Names of contact groups, such as "hand|mug".
        obstacles: What fills the scene's slots, at most as many of a kind as there are.

    Raises:
        ValueError: There is no slot of that kind left, or no such contact group; a mocap
            body is held.
    """
    refuse_fork()
    check("scene", scene, Scene)
    if object_pose is None:
        poses = [_reference_pose(scene, name) for name in scene.objects]
        object_pose = np.array(poses).reshape(-1, 7)
    if held is None:
        held = np.zeros(len(scene.objects), bool)
    if scene.mocap and np.any(np.asarray(held)[..., -len(scene.mocap) :]):
        names = ", ".join(scene.mocap)
        raise ValueError(
            f"mocap bodies cannot be held, they have no free joint: {names}"
        )
    if passive is None:
        passive = scene.mj_model.qpos0[scene.addresses(scene.passive)]
    return World(
        jnp.asarray(object_pose, jnp.float32),
        jnp.asarray(held, bool),
        jnp.asarray(passive, jnp.float32),
        jnp.asarray(scene.ignored(ignored)),
        *_fill(scene, obstacles),
    )


def _fill(scene: Scene, obstacles: Iterable[Obstacle]) -> tuple[jax.Array, jax.Array]:
    """`slot_pose` and `slot_size` with each obstacle in the first free slot of its kind."""
    pose = np.tile(np.array(FAR, np.float32), (len(scene.slots), 1))
    size = np.full((len(scene.slots), 3), 0.01, np.float32)
    free: dict[str, list[int]] = {}
    for index, slot in enumerate(scene.slots):
        free.setdefault(slot.kind, []).append(index)
    for obstacle in obstacles:
        if not free.get(obstacle.kind):
            raise ValueError(
                f"no slot is left for a {obstacle.kind}: the scene has "
                f"{sum(slot.kind == obstacle.kind for slot in scene.slots)} "
                "(see `slots` of Scene.from_mjcf)"
            )
        if (
            len(obstacle.pose) not in (3, 7)
            or len(obstacle.size) != SIZES[obstacle.kind]
        ):
            raise ValueError(
                f"{obstacle}: expected {SIZES[obstacle.kind]} sizes and a pose of 3 or 7"
            )
        index = free[obstacle.kind].pop(0)
        pose[index, : len(obstacle.pose)] = obstacle.pose
        size[index, : len(obstacle.size)] = obstacle.size
        if len(obstacle.pose) == 3:
            pose[index, 3:] = FAR[3:]
    return jnp.asarray(pose), jnp.asarray(size)


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
        return np.concatenate([model.body_pos[body], model.body_quat[body]])
    start = object_address(scene, name)
    return model.qpos0[start : start + 7]

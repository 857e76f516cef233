"""Trained segments for the problems of one scene: `Planner(sampler=...)`.

Unlike in an episode there is no picture: the sampler is told what the planner knows, where the
search starts and ends and where things are.
"""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision import XLA_OPTIONS, World
from jaxplan.collision.kinematics import link_poses, rotation_of
from jaxplan.collision.obstacles import FAR, SIZES
from jaxplan.learning.weights import Weights, WeightsError
from jaxplan.networks import SceneCond
from jaxplan.planning import DrawBank
from jaxplan.planning.space import short_way
from jaxplan.samplers.bank import SIZE, Bank
from jaxplan.scene import Scene
from jaxplan.scene.identity import difference, identity

ENCODING = 1
"""Of what a sampler is told of a problem (`condition`); another number, other data."""
LARGE = 10.0
"""Sizes [m] are multiplied by it, so that they are numbers near 1."""


class SceneSampler:
    """A trained sampler of a scene, see `jaxplan.load_sampler`.

    Args:
        weights: Of any family, trained by `python -m jaxplan.train scene_...`.
        size: Segments of a bank.
        **changes: To the sampler's config, such as `num_inference_steps`.

    Raises:
        WeightsError: Weights of an episode's sampler, which sees pictures, or of another
            version.
        ValueError: The sampler has no such setting.
    """

    def __init__(self, weights: Weights, size: int = SIZE, **changes: Any) -> None:
        if weights.config.surroundings is None:
            raise WeightsError(
                f"{weights.info.get('file')} is of a sampler that sees pictures: "
                "see samplers.Bank.seeing"
            )
        if weights.info.get("encoding") != ENCODING:
            raise WeightsError(
                f"{weights.info.get('file')} was trained by another version of jaxplan: "
                "record and train it anew"
            )
        self.scene: dict[str, Any] = weights.info["scene"]
        """Of which scene, see `scene.identity`."""
        self.bank = Bank(weights, size, **changes)

    def for_scene(self, scene: Scene) -> "SceneProposals":
        """Its segments for the planner of a scene.

        Raises:
            WeightsError: It was trained for another scene.
        """
        if differs := difference(identity(scene), self.scene):
            raise WeightsError(f"the sampler was trained for another scene: {differs}")
        return SceneProposals(self.bank, scene)


@dataclasses.dataclass(frozen=True, eq=False)
class SceneProposals:
    """Segments for problems in a scene: `motion.sampling.Proposals`."""

    bank: Bank
    scene: Scene

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is without its program."""
        return SceneProposals, (self.bank, self.scene)

    def __call__(
        self, q_start: np.ndarray, q_goal: np.ndarray, keys: jax.Array, world: World
    ) -> DrawBank:
        """Banks of P problems; the world's leaves have a leading axis P, or none."""
        if np.ndim(world.passive) == 1:
            rows = (len(q_start),)
            world = jax.tree.map(lambda x: np.broadcast_to(x, rows + x.shape), world)
        return self.bank.of(self._conditions(world, q_start, q_goal), keys, alike=True)

    @cached_property
    def _conditions(self) -> Callable[..., SceneCond]:
        return conditions_in(self.scene)


def conditions_in(scene: Scene) -> Callable[..., SceneCond]:
    """Compiled: `(world, q_start, q_goal) -> SceneCond`, all leaves `[P, ...]`.

    One after the other, so that what a problem gets does not depend on those beside it.
    """

    def one(problem: tuple[World, jax.Array, jax.Array]) -> SceneCond:
        return condition(scene, *problem)

    def every(*problems: Any) -> SceneCond:
        return jax.lax.map(one, problems)

    return jax.jit(every, compiler_options=XLA_OPTIONS)


def condition(
    scene: Scene, world: World, q_start: jax.Array, q_goal: jax.Array
) -> SceneCond:
    """What a sampler is told of a problem.

    Args:
        scene: The scene.
        world: Without batch axes.
        q_start: `[d]` [rad or m].
        q_goal: `[d]` [rad or m].

    Returns:
        Leaves without batch axes. The state: joints at start, goal and halfway (in parts of
        their range, or sine and cosine), the way from start to goal, and where these three
        bring the links [m]. Things: slots, then objects: kind or name as one of several, size,
        position [m], rotation.
    """
    way = jnp.where(scene.circular, short_way(q_goal - q_start), q_goal - q_start)
    ends = q_start + jnp.array([0.0, 0.5, 1.0])[:, None] * way
    # Only where links are; what is held and what the fingers do is not said.
    batch_last = World(*(leaf[..., None] for leaf in world))
    placed = [link.object < 0 for link in scene.structure.links]
    poses = link_poses(scene, batch_last, ends.T)[1:][np.array(placed)]
    state = [_joints(scene, ends), way, poses[:, :, 3]]
    kinds, objects = list(SIZES), len(scene.objects)
    slots = [kinds.index(slot.kind) for slot in scene.slots]
    which = np.eye(len(kinds) + objects)[
        [*slots, *range(len(kinds), len(kinds) + objects)]
    ].reshape(-1, len(kinds) + objects)
    pose = jnp.concatenate([world.slot_pose, world.object_pose])
    size = jnp.concatenate([LARGE * world.slot_size, jnp.zeros((objects, 3))])
    turned = rotation_of(pose[:, 3:].T)[:, :2].reshape(6, -1).T
    return SceneCond(
        q=q_start,
        state=jnp.concatenate([part.reshape(-1) for part in state]),
        things=jnp.concatenate([which, size, pose[:, :3], turned], axis=-1),
        there=pose[:, 2] < FAR[2] / 2,
    )


def _joints(scene: Scene, q: jax.Array) -> jax.Array:
    """`[n, d + c]`: c joints come round, and the others' ranges are [-1, 1]."""
    low, high = scene.q_min, scene.q_max
    bounded = jnp.isfinite(low) & jnp.isfinite(high)
    centre = jnp.where(bounded, 0.5 * (low + high), 0.0)
    half = jnp.where(bounded, 0.5 * (high - low), jnp.pi)
    plain = jnp.where(scene.circular, jnp.sin(q), (q - centre) / half)
    return jnp.concatenate([plain, jnp.cos(q[:, scene.circular])], axis=-1)

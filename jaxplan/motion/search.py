"""What compiles once for a scene and settings: the only maker of a compiled search."""

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import jax
import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.config import PlannerConfig
from jaxplan.ik import Limits
from jaxplan.planning import PlanResult, make_planner
from jaxplan.robots import JointLimits
from jaxplan.scene import Scene

jit: Any = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


def sampled_search(
    scene: Scene, config: PlannerConfig, limits: JointLimits
) -> "Search":
    """Of a robot's arm, whose joints all have limits; paths are checked at samples."""
    joints = Limits(limits.q_min, limits.q_max, np.zeros(len(limits.q_min), bool))
    return Search(scene, config, joints, proven=False)


class Search:
    """Programs of one scene; each compiles at its first use.

    Args:
        scene: What can touch what.
        config: Settings of the search.
        limits: Of the joints.
        proven: Paths are free all along and not at samples only (see `make_planner`).
    """

    def __init__(
        self, scene: Scene, config: PlannerConfig, limits: Limits, proven: bool = True
    ) -> None:
        self._made = scene, config, limits, proven
        self._searches: dict[bool, Callable[..., PlanResult]] = {}

    def __reduce__(self) -> tuple[type, tuple]:
        """A copy is without programs."""
        return Search, self._made

    @cached_property
    def clearance(self) -> Callable[[World, np.ndarray], jax.Array]:
        """`(world, q) -> [...]` [m]."""
        scene = self._made[0]
        return jit(lambda world, q: collision.clearance(scene, world, q))

    @cached_property
    def free(self) -> Callable[..., jax.Array]:
        """`(world, q) -> [...]` bool; `(world, q, motion)`: proven free all around."""
        return jit(self._config_free)

    @cached_property
    def free_rows(self) -> Callable[..., jax.Array]:
        """`(worlds, problem [R], q [R, d]) -> [R]`, leaves of worlds `[P, ...]`."""
        return jit(self._rows_free)

    def __call__(self, own: bool = True) -> Callable[..., PlanResult]:
        """The search, see `make_planner`; `own`: each problem has a world of its own."""
        if own not in self._searches:
            _, config, (q_min, q_max, circular), proven = self._made
            free = self._rows_free if own else self._shared_free
            swept = free if proven else None
            self._searches[own] = make_planner(
                free, config, q_min, q_max, jit, circular, swept
            )
        return self._searches[own]

    def _config_free(
        self, world: World, q: jax.Array, motion: jax.Array | None = None
    ) -> jax.Array:
        scene, config, _, _ = self._made
        return collision.config_free(scene, world, q, config.margin, motion=motion)

    def _rows_free(self, worlds: World, problem: jax.Array, *q: jax.Array) -> jax.Array:
        world = jax.tree.map(lambda leaf: leaf[problem], worlds)
        return self._config_free(world, *q)

    def _shared_free(
        self, world: World, problem: jax.Array, *q: jax.Array
    ) -> jax.Array:
        return self._config_free(world, *q)

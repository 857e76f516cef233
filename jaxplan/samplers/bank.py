"""Trained weights as a source of segments: for the episode loop, the studies, any planner."""

import dataclasses
from functools import cached_property, partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision import XLA_OPTIONS, World
from jaxplan.learning.weights import Weights, WeightsError
from jaxplan.networks import AnyCond, Cond, row_by_row
from jaxplan.planning import DrawBank, Segment
from jaxplan.samplers.families import draw
from jaxplan.scene import Scene

SIZE = 32
"""Learned segments drawn at a time for a problem; a search that uses them up gets as many more."""


class Bank:
    """Learned segments, `size` at a time, by one compiled program for a number of problems.

    Args:
        weights: Of a sampler.
        size: Segments of a bank.
        **changes: To the sampler's config, such as `num_inference_steps`.

    Raises:
        ValueError: The sampler has no such setting.
    """

    def __init__(self, weights: Weights, size: int = SIZE, **changes: Any) -> None:
        known = {field.name for field in dataclasses.fields(weights.config)}
        if unknown := sorted(set(changes) - known):
            kind = type(weights.config).__name__
            raise ValueError(f"{unknown[0]} {changes[unknown[0]]}: {kind} has none")
        self.weights, self._changes = weights, changes
        self.config, self.size = dataclasses.replace(weights.config, **changes), size

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is without its program."""
        return partial(Bank, **self._changes), (self.weights, self.size)

    @cached_property
    def _draw(self) -> Any:
        return jax.jit(self._drawn, compiler_options=XLA_OPTIONS)

    @cached_property
    def _draw_each(self) -> Any:
        """One problem after the other."""
        return jax.jit(row_by_row(self._drawn), compiler_options=XLA_OPTIONS)

    def _drawn(self, cond: AnyCond, keys: jax.Array, number: jax.Array) -> Segment:
        keys = jax.vmap(jax.random.fold_in)(keys, number)
        return draw(self.config, self.weights.params, cond, keys, self.size)

    def of(self, cond: AnyCond, keys: jax.Array, alike: bool = False) -> DrawBank:
        """Banks of P problems, with fresh noise for each number.

        Args:
            cond: Conditions, leaves `[P, ...]`.
            keys: Typed, `[P]`. A problem's segments depend on its own key and condition only.
            alike: To the last bit, whatever P is. On a CPU they always are, which costs a
                quarter more; elsewhere it is slow where P is large.
        """
        alike = alike or jax.default_backend() == "cpu"
        program = self._draw_each if alike else self._draw
        return lambda number: program(cond, keys, jnp.asarray(number))

    def seeing(
        self,
        image: np.ndarray,
        gripper: int,
        gripper_toggle: int,
        q_toggle: np.ndarray | None = None,
    ) -> "Seeing":
        """For `Planner(sampler=...)`: start and goal are the problem's, the rest is given.

        Args:
            image: `[88, 136, 3]` uint8, or the predictor's features `[F]`.
            gripper: 0 open, 1 closed.
            gripper_toggle: Its mode after the toggle.
            q_toggle: `[d]` [rad]; each problem's goal where None.
        """
        return Seeing(self, image, gripper, gripper_toggle, q_toggle)


@dataclasses.dataclass(frozen=True, eq=False)
class Seeing:
    """A bank under one observation: a `motion.sampling.Sampler`, and its own `Proposals`."""

    bank: Bank
    image: np.ndarray
    gripper: int
    gripper_toggle: int
    q_toggle: np.ndarray | None

    def for_scene(self, scene: Scene) -> "Seeing":
        """The same, if its arm has as many joints.

        Raises:
            WeightsError: It has not.
        """
        joints = len(self.bank.config.q_min)
        if len(scene.joints) != joints:
            raise WeightsError(
                f"the sampler is for {joints} joints, the scene has {len(scene.joints)}"
            )
        return self

    def __call__(
        self, q_start: np.ndarray, q_goal: np.ndarray, keys: jax.Array, world: World
    ) -> DrawBank:
        """Banks of problems `[P, d]` [rad] with typed keys `[P]`."""
        problems = len(q_start)

        def each(value: Any) -> jax.Array:
            return jnp.broadcast_to(value, (problems, *np.shape(value)))

        q_toggle = q_goal if self.q_toggle is None else each(self.q_toggle)
        cond = Cond(
            image=each(self.image),
            q=jnp.asarray(q_start),
            gripper=each(np.int32(self.gripper)),
            q_toggle=jnp.asarray(q_toggle),
            gripper_toggle=each(np.int32(self.gripper_toggle)),
            q_goal=jnp.asarray(q_goal),
        )
        return self.bank.of(cond, keys, alike=True)

"""Where a planner's learned segments come from: a function of the user's, or trained weights."""

from collections.abc import Callable
from functools import cached_property
from typing import Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.collision import World
from jaxplan.motion.search import jit
from jaxplan.planning import DrawBank, Segment
from jaxplan.scene import Scene

SegmentFunction = Callable[[jax.Array, jax.Array, jax.Array, int], Segment]
"""`(key, q_start [d], q_goal [d], count) -> Segment [count]`: tree-extension segments for a
problem, with the configurations where they begin or without; traced by JAX."""

SIZE = 64
"""Segments that a function is asked for at a time."""


Proposals = Callable[[np.ndarray, np.ndarray, jax.Array, World], DrawBank]
"""`(q_start [P, d], q_goal [P, d], keys [P], world)`: banks of P problems with typed keys; the
world's leaves have a leading axis P, or none where it is that of all."""


@runtime_checkable
class Sampler(Protocol):
    """Proposes segments for problems, from trained weights.

    `jaxplan.load_sampler` gives one for a scene, `samplers.Bank.seeing` one that sees a picture.
    """

    def for_scene(self, scene: Scene) -> Proposals:
        """Its proposals in a scene.

        Raises:
            ValueError: It knows nothing of such a scene.
        """
        ...


class FunctionSampler:
    """A user's function as a `Sampler`.

    Args:
        function: Of one problem.
        size: Segments of a bank.
    """

    def __init__(self, function: SegmentFunction, size: int) -> None:
        self._made = function, size

    def __reduce__(self) -> tuple[type, tuple]:
        """A copy is without programs."""
        return FunctionSampler, self._made

    def for_scene(self, scene: Scene) -> Proposals:
        """The same in any scene."""
        return self._between

    def _between(
        self, q_start: np.ndarray, q_goal: np.ndarray, keys: jax.Array, world: World
    ) -> DrawBank:
        return lambda number: self._banks(keys, number, q_start, q_goal)

    @cached_property
    def _banks(self) -> Callable[..., Segment]:
        function, size = self._made

        def bank(key, number, q_start, q_goal):
            # Apart from the numbers of the search, which fold in expansions from 0 on.
            key = jax.random.fold_in(jax.random.fold_in(key, 2**31), number)
            segment = Segment(*function(key, q_start, q_goal, size))
            many = size, len(q_start)
            expected = {"direction": many, "length": (size,), "base": many}
            for name, leaf in segment._asdict().items():
                if leaf is not None and jnp.shape(leaf) != expected[name]:
                    raise ValueError(
                        f"the sampler's {name} has shape {jnp.shape(leaf)}, "
                        f"expected {expected[name]}"
                    )
            return segment

        return jit(jax.vmap(bank))

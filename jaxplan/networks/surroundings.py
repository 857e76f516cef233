"""What a sampler of a scene is conditioned on: start, goal, and a set of the things around.

Each thing is looked at together with start and goal, and of all things the largest feature
counts (PointNet, Qi et al. 2017; Deep Sets, Zaheer et al. 2017). So their order changes nothing,
and neither do slots in which nothing is.
"""

from dataclasses import dataclass
from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.mish import mish
from jaxplan.networks.mlp import mlp
from jaxplan.ranges import Checked, Count, Whole


@dataclass(frozen=True)
class SurroundingsConfig(Checked):
    """How start, goal and the things around become one vector."""

    state: Whole = 0
    """Numbers of a state; 0: as many as the scene of the data has."""
    thing: Whole = 0
    """Numbers of a thing; likewise, and 0 where nothing can be around."""
    hidden: Count = 128
    features: Count = 128
    """Of all things together."""


class SceneCond(NamedTuple):
    """Of a problem in a scene; see `samplers.scene.conditions`."""

    q: jax.Array
    """[..., d] where the search starts [rad or m]."""
    state: jax.Array
    """[..., S] start, goal, and where they bring the links."""
    things: jax.Array
    """[..., n, T] obstacles and objects: what they are, how large, where."""
    there: jax.Array
    """[..., n] bool: the others are empty slots."""


class Surroundings(nn.Module):
    """The condition's vector."""

    config: SurroundingsConfig
    outputs: int

    def setup(self) -> None:
        config = self.config
        self.state = mlp(config.hidden, config.features)
        self.from_state = nn.Dense(config.hidden)
        self.from_thing = nn.Dense(config.hidden, use_bias=False)
        self.middle = nn.Dense(config.hidden)
        self.thing = nn.Dense(config.features)
        self.project = nn.Dense(self.outputs)

    def __call__(self, cond: SceneCond) -> jax.Array:
        """`[..., outputs]`."""
        parts = [self.state(cond.state)]
        if cond.things.shape[-2]:
            h = self.from_thing(cond.things) + self.from_state(cond.state)[..., None, :]
            each = self.thing(mish(self.middle(mish(h))))
            there = cond.there[..., None]
            most = jnp.max(jnp.where(there, each, -jnp.inf), axis=-2)
            parts.append(jnp.where(jnp.any(there, axis=-2), most, 0.0))
        return self.project(mish(jnp.concatenate(parts, axis=-1)))

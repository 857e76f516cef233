"""The condition network, the same for every learned sampler: what it sees as one vector."""

from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.config import SegmentConfig
from jaxplan.networks.joints import normalize
from jaxplan.networks.mish import mish
from jaxplan.networks.predictor import state_vector
from jaxplan.networks.resnet import Encoder


class Cond(NamedTuple):
    """cond = (I, q_curr, q_goal, q_toggle, g_toggle), at the phase's start."""

    image: jax.Array
    """u8 [..., 88, 136, 3]; with `encoder=None` the predictor's features [..., F]."""
    q: jax.Array
    """[..., 7] [rad]."""
    gripper: jax.Array
    """[...], 0 open, 1 closed."""
    q_toggle: jax.Array
    """[..., 7] [rad]."""
    gripper_toggle: jax.Array
    """[...], 0 open, 1 closed."""
    q_goal: jax.Array
    """[..., 7] [rad]."""


class Condition(nn.Module):
    """Image features, state and targets, each through its own layers, joined linearly."""

    config: SegmentConfig

    def setup(self) -> None:
        config = self.config
        self.encoder = config.encoder and Encoder(config.encoder)
        self.image_norm = nn.LayerNorm()
        self.state, self.targets = mlp(64, 64), mlp(128, 128)
        self.project = nn.Dense(config.cond_features)

    def __call__(self, cond: Cond) -> jax.Array:
        """`[..., cond_features]`."""
        config = self.config
        image = (
            cond.image if self.encoder is None else self.encoder(cond.image).features
        )
        limits = config.q_min, config.q_max
        targets = [
            state_vector(cond.q_toggle, cond.gripper_toggle, *limits),
            normalize(cond.q_goal, *limits),
        ]
        if config.relative:
            targets += [cond.q_toggle - cond.q, cond.q_goal - cond.q]
        parts = [
            self.image_norm(image),
            self.state(state_vector(cond.q, cond.gripper, *limits)),
            self.targets(jnp.concatenate(targets, axis=-1)),
        ]
        return self.project(jnp.concatenate(parts, axis=-1))


def mlp(hidden: int, outputs: int) -> nn.Sequential:
    """Two layers with Mish between them; for a module's `setup`."""
    return nn.Sequential([nn.Dense(hidden), mish, nn.Dense(outputs)])

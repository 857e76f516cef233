"""The condition network, the same for every learned sampler: what it sees as one vector."""

from dataclasses import dataclass
from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.joints import normalize
from jaxplan.networks.mish import mish
from jaxplan.networks.resnet import Encoder, EncoderConfig
from jaxplan.networks.sight import state_vector
from jaxplan.ranges import Checked, Count, NotNegative, Number, Positive
from jaxplan.robots.panda.limits import Q_MAX, Q_MIN


@dataclass(frozen=True)
class SegmentConfig(Checked):
    """What all learned samplers have in common: what they see, and what a segment is."""

    encoder: EncoderConfig | None = EncoderConfig()
    """None: the condition holds the predictor's image features, frozen."""
    cond_features: Count = 256
    relative: bool = False
    """Adds q_toggle - q_curr and q_goal - q_curr [rad] to the condition's input."""
    tree_context: bool = False
    """A segment comes with the configuration at which it is meant to begin."""
    temperature: NotNegative = 1.0
    """Factor on the noise that segments are drawn from; training does not look at it. Below 1
    they keep to what is typical: more precise, less diverse."""
    step_min: Positive = 0.05
    step_max: Positive = 0.2
    """s in [step_min, step_max] [rad]."""
    q_min: tuple[Number, ...] = Q_MIN
    q_max: tuple[Number, ...] = Q_MAX

    @property
    def size(self) -> int:
        """Length of x_0: direction and step length, and with `tree_context` the base."""
        joints = len(self.q_min)
        return joints + 1 + self.tree_context * joints


class Cond(NamedTuple):
    """cond = (I, q_curr, q_goal, q_toggle, g_toggle), at the phase's start."""

    image: jax.Array
    """u8 [..., 88, 136, 3]; with `encoder=None` the predictor's features [..., F]."""
    q: jax.Array
    """[..., d] [rad]."""
    gripper: jax.Array
    """[...], 0 open, 1 closed."""
    q_toggle: jax.Array
    """[..., d] [rad]."""
    gripper_toggle: jax.Array
    """[...], 0 open, 1 closed."""
    q_goal: jax.Array
    """[..., d] [rad]."""


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

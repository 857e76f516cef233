"""The condition network, the same for every learned sampler: what it sees as one vector.

It sees a picture and the upper network's targets (`Cond`, the paper's), or in any scene start,
goal and what stands around (`SceneCond`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.joints import normalize
from jaxplan.networks.mlp import mlp
from jaxplan.networks.resnet import Encoder, EncoderConfig
from jaxplan.networks.sight import state_vector
from jaxplan.networks.surroundings import SceneCond, Surroundings, SurroundingsConfig
from jaxplan.ranges import Checked, Count, NotNegative, Number, Positive
from jaxplan.robots.panda.limits import Q_MAX, Q_MIN


@dataclass(frozen=True)
class SegmentConfig(Checked):
    """What all learned samplers have in common: what they see, and what a segment is."""

    encoder: EncoderConfig | None = EncoderConfig()
    """None: the condition holds the predictor's image features, frozen."""
    surroundings: SurroundingsConfig | None = None
    """The condition is a `SceneCond`, and `encoder` and `relative` are nothing to it; None: a
    `Cond`."""
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
    base_spread: Positive = 0.5
    """Typical distance of a segment's base from q_curr in a joint [rad]."""
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


AnyCond = Cond | SceneCond
"""What a learned sampler is conditioned on."""


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


def condition_of(config: SegmentConfig) -> nn.Module:
    """The module that a config's conditions go through; for a module's `setup`."""
    if config.surroundings is None:
        return Condition(config)
    return Surroundings(config.surroundings, config.cond_features)

"""The CVAE sampler's network (Ichter, Harrison and Pavone, ICRA 2018), over segments."""

from dataclasses import dataclass

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.condition import AnyCond, SegmentConfig, condition_of
from jaxplan.networks.conditioned_mlp import ConditionedMlp
from jaxplan.ranges import Count


@dataclass(frozen=True)
class CvaeConfig(SegmentConfig):
    """The conditional VAE of Ichter, Harrison and Pavone, over segments."""

    latent: Count = 3
    hidden: tuple[Count, ...] = (512, 512)
    """Of the recognition network and of the decoder."""


class CvaeNetwork(nn.Module):
    """q(z | x_0, cond) in training, and the mean of p(x_0 | z, cond)."""

    config: CvaeConfig

    def setup(self) -> None:
        config = self.config
        self.condition = condition_of(config)
        self.recognition = ConditionedMlp(config.hidden, 2 * config.latent, nn.relu)
        self.decoder = ConditionedMlp(config.hidden, config.size, nn.relu)

    def cond(self, cond: AnyCond) -> jax.Array:
        """The vector of a condition, [..., cond_features]."""
        return self.condition(cond)

    def recognize(self, x_0: jax.Array, cond: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Mean and log variance of z [..., latent], for x_0 [..., 8] and vectors."""
        mean, log_var = jnp.split(self.recognition(x_0, cond), 2, axis=-1)
        return mean, log_var

    def generate(self, z: jax.Array, cond: jax.Array) -> jax.Array:
        """x_0 [..., 8] for z [..., latent] and vectors broadcastable to [..., C]."""
        return self.decoder(z, cond)

    def __call__(self, x_0: jax.Array, cond: AnyCond) -> jax.Array:
        """Everything once, for initialisation."""
        z, _ = self.recognize(x_0, self.cond(cond))
        return self.draw(z, cond)

    def draw(self, z: jax.Array, cond: AnyCond) -> jax.Array:
        """What drawing needs once, for initialisation."""
        return self.generate(z, self.cond(cond))

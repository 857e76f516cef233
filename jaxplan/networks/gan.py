"""The conditional GAN's two networks, over segments; each has a condition network."""

from dataclasses import dataclass

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.condition import AnyCond, SegmentConfig, condition_of
from jaxplan.networks.conditioned_mlp import ConditionedMlp
from jaxplan.ranges import Count


@dataclass(frozen=True)
class GanConfig(SegmentConfig):
    """Conditional GAN over segments. The paper gives no architecture."""

    latent: Count = 16
    generator: tuple[Count, ...] = (512, 512, 512)
    discriminator: tuple[Count, ...] = (512, 512)


class GanNetwork(nn.Module):
    """G(z, cond) and D(x_0, cond); their weights are `generator` and `discriminator`."""

    config: GanConfig

    def setup(self) -> None:
        self.generator = Generator(self.config)
        self.discriminator = Discriminator(self.config)

    def cond(self, cond: AnyCond) -> jax.Array:
        """The generator's vector of a condition, [..., cond_features]."""
        return self.generator.cond(cond)

    def generate(self, z: jax.Array, cond: jax.Array) -> jax.Array:
        """x_0 [..., 8] for z [..., latent] and vectors broadcastable to [..., C]."""
        return self.generator(z, cond)

    def judge(self, x_0: jax.Array, cond: AnyCond) -> jax.Array:
        """Logit [...] of x_0 [..., 8] being a true segment of the condition."""
        return self.discriminator(x_0, cond)

    def __call__(self, z: jax.Array, cond: AnyCond) -> jax.Array:
        """Everything once, for initialisation."""
        return self.judge(self.draw(z, cond), cond)

    def draw(self, z: jax.Array, cond: AnyCond) -> jax.Array:
        """What drawing needs once, for initialisation."""
        return self.generate(z, self.cond(cond))


class Generator(nn.Module):
    """Its x_0 is a segment by construction: u of length 1, s within its bounds."""

    config: GanConfig

    def setup(self) -> None:
        config = self.config
        self.condition = condition_of(config)
        self.mlp = ConditionedMlp(config.generator, config.size, nn.leaky_relu)

    def cond(self, cond: AnyCond) -> jax.Array:
        return self.condition(cond)

    def __call__(self, z: jax.Array, cond: jax.Array) -> jax.Array:
        out, joints = self.mlp(z, cond), len(self.config.q_min)
        u, s, base = jnp.split(out, [joints, joints + 1], axis=-1)
        square = jnp.sum(u * u, axis=-1, keepdims=True)
        u = u * jnp.sqrt(joints / (square + 1e-6))
        return jnp.concatenate([u, jnp.tanh(s), base], axis=-1)


class Discriminator(nn.Module):
    """True or drawn; without normalisation layers, since R1 needs a gradient per sample."""

    config: GanConfig

    def setup(self) -> None:
        self.condition = condition_of(self.config)
        self.mlp = ConditionedMlp(self.config.discriminator, 1, nn.leaky_relu)

    def __call__(self, x_0: jax.Array, cond: AnyCond) -> jax.Array:
        return self.mlp(x_0, self.condition(cond))[..., 0]

"""The conditional GAN: losses non-saturating, with R1 on true segments.

Both networks take their steps at once, from one sum of two losses in each of which the
other network's weights are held fixed. So one optimiser and one state serve both.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.learning.sampler import Phases, SegmentTraining, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import AnyCond, GanConfig, GanNetwork
from jaxplan.ranges import NotNegative
from jaxplan.samplers.family import Family
from jaxplan.samplers.one_pass import one_pass


@dataclass(frozen=True, kw_only=True)
class GanTraining(SegmentTraining):
    """`python -m jaxplan.train gan`."""

    name: str = "gan"
    network: GanConfig = GanConfig()
    r1: NotNegative = 0.1
    """Gamma of the penalty gamma / 2 |grad D|^2 on true segments."""
    instance_noise: NotNegative = 0.02
    """Standard deviation of the noise on what the discriminator sees."""


def fresh(config: GanConfig, key: jax.Array, cond: AnyCond, training: bool) -> Params:
    """Fresh weights; for training those of the discriminator too."""
    network, z = GanNetwork(config), jnp.zeros((1, config.latent))
    if training:
        return network.init(key, z, cond)
    return network.init(key, z, cond, method="draw")


def loss(
    config: GanTraining, params: Params, key: jax.Array, batch: Phases
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """The discriminator's loss plus the generator's."""
    key_examples, key_z, key_noise = jax.random.split(key, 3)
    cond, x_0 = examples(config, key_examples, batch)
    network: Any = GanNetwork(config.network)
    z = jax.random.normal(key_z, (len(x_0), config.network.latent))
    fake = network.apply(params, z, cond, method="draw")
    blur = config.instance_noise * jax.random.normal(key_noise, (2, *x_0.shape))
    real, fake = x_0 + blur[0], fake + blur[1]

    def judge(params: Params, x: jax.Array) -> jax.Array:
        return network.apply(params, x, cond, method="judge")

    slope = jax.grad(lambda x: judge(params, x).sum())(real)
    penalty = 0.5 * config.r1 * jnp.mean(jnp.sum(slope**2, axis=-1))
    true, drawn = judge(params, real), judge(params, jax.lax.stop_gradient(fake))
    discriminator = jnp.mean(jax.nn.softplus(-true) + jax.nn.softplus(drawn))
    fixed = jax.lax.stop_gradient(params)
    generator = jnp.mean(jax.nn.softplus(-judge(fixed, fake)))
    return discriminator + penalty + generator, {
        "discriminator": discriminator,
        "generator": generator,
        "penalty": penalty,
    }


GAN = Family(
    "gan", GanConfig, GanTraining, GanNetwork, fresh, one_pass(GanNetwork), loss
)

"""The conditional GAN's losses: non-saturating, with R1 on true segments.

Both networks take their steps at once, from one sum of two losses in each of which the
other network's weights are held fixed. So one optimiser and one state serve both.
"""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.config import GanTraining
from jaxplan.learning.sampler import Phases, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import GanNetwork


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

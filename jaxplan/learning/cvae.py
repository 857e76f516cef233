"""The CVAE's loss (Ichter, Harrison and Pavone, ICRA 2018), over segments."""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.config import CvaeTraining
from jaxplan.learning.sampler import Phases, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import CvaeNetwork


def loss(
    config: CvaeTraining, params: Params, key: jax.Array, batch: Phases
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Reconstruction plus KL divergence; both are metrics too.

    A KL near 0 says that the latent is ignored (posterior collapse).
    """
    key_examples, key_z = jax.random.split(key)
    cond, x_0 = examples(config, key_examples, batch)
    network: Any = CvaeNetwork(config.network)
    vector = network.apply(params, cond, method="cond")
    mean, log_var = network.apply(params, x_0, vector, method="recognize")
    z = mean + jnp.exp(0.5 * log_var) * jax.random.normal(key_z, mean.shape)
    out = network.apply(params, z, vector, method="generate")
    reconstruction = jnp.mean((out - x_0) ** 2)
    kl = 0.5 * jnp.mean(jnp.sum(jnp.exp(log_var) + mean**2 - 1.0 - log_var, axis=-1))
    value = reconstruction + config.kl_weight * kl
    return value, {"reconstruction": reconstruction, "kl": kl}

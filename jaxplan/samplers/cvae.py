"""The conditional VAE of Ichter, Harrison and Pavone (ICRA 2018), over segments."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.learning.sampler import Phases, SegmentTraining, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import AnyCond, CvaeConfig, CvaeNetwork
from jaxplan.ranges import NotNegative
from jaxplan.samplers.family import Family
from jaxplan.samplers.one_pass import one_pass


@dataclass(frozen=True, kw_only=True)
class CvaeTraining(SegmentTraining):
    """`python -m jaxplan.train cvae`."""

    name: str = "cvae"
    network: CvaeConfig = CvaeConfig()
    kl_weight: NotNegative = 4e-4
    """Of the KL divergence (summed over the latent's coordinates) beside the mean squared
    error of a coordinate; Ichter's number."""


def fresh(config: CvaeConfig, key: jax.Array, cond: AnyCond, training: bool) -> Params:
    """Fresh weights; for training those of the recognition network too."""
    network = CvaeNetwork(config)
    if training:
        return network.init(key, jnp.zeros((1, config.size)), cond)
    return network.init(key, jnp.zeros((1, config.latent)), cond, method="draw")


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


CVAE = Family(
    "cvae", CvaeConfig, CvaeTraining, CvaeNetwork, fresh, one_pass(CvaeNetwork), loss
)

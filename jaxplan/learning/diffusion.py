"""The diffusion sampler's loss (equation 5)."""

from typing import Any

import jax

from jaxplan import diffusion
from jaxplan.config import SamplerTraining
from jaxplan.learning.sampler import Phases, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import SamplerNetwork


def loss(
    config: SamplerTraining, params: Params, key: jax.Array, batch: Phases
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Mean squared error of the noise on fresh segments."""
    key_examples, key_eps = jax.random.split(key)
    cond, x_0 = examples(config, key_examples, batch)
    network: Any = SamplerNetwork(config.network)

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        return network.apply(params, x_t, t, cond)

    steps = config.network.num_train_timesteps
    return diffusion.eps_loss(key_eps, denoise, x_0, steps), {}

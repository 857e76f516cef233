"""The paper's sampler: tree-extension segments from a conditional diffusion model."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.learning.sampler import Phases, SegmentTraining, examples
from jaxplan.learning.train_state import Params
from jaxplan.networks import AnyCond, SamplerConfig, SamplerNetwork
from jaxplan.planning.segment import Segment
from jaxplan.samplers.family import Family
from jaxplan.samplers.segments import noise, segments


@dataclass(frozen=True, kw_only=True)
class SamplerTraining(SegmentTraining):
    """`python -m jaxplan.train sampler`."""

    name: str = "sampler"
    network: SamplerConfig = SamplerConfig()


def fresh(
    config: SamplerConfig, key: jax.Array, cond: AnyCond, training: bool
) -> Params:
    """Fresh weights."""
    x_0, t = jnp.zeros((1, config.size)), jnp.zeros(1, jnp.int32)
    return SamplerNetwork(config).init(key, x_0, t, cond)


def draw(
    config: SamplerConfig, params: dict, cond: AnyCond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems by DDIM; see `samplers.draw`."""
    steps = diffusion.timesteps(config.num_train_timesteps, config.num_inference_steps)
    x_0 = diffusion.ddim(
        denoiser(config, params, cond, steps),
        noise(config, keys, n, config.size),
        config.num_train_timesteps,
        steps,
        clip=diffusion.bounds(len(config.q_min), config.tree_context),
    )
    return segments(config, x_0, cond)


def denoiser(
    config: SamplerConfig, params: dict, cond: AnyCond, steps: np.ndarray
) -> diffusion.Denoise:
    """(x_t [P, n, size], t) -> the network's output, for t among `steps`.

    The FiLM vectors of all noise steps are made here, once per problem: of the loop, only
    the denoiser itself is left.
    """
    network: Any = SamplerNetwork(config)
    vector = network.apply(params, cond, method="cond")
    table = network.apply(params, vector, jnp.asarray(steps)[:, None], method="film")
    row = np.zeros(config.num_train_timesteps, np.int32)
    row[steps] = np.arange(len(steps))

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        film = table[jnp.asarray(row)[t]][:, None, :]
        return network.apply(params, x_t, film, method="denoise")

    return denoise


def loss(
    config: SamplerTraining, params: Params, key: jax.Array, batch: Phases
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Equation 5: mean squared error of the noise on fresh segments."""
    key_examples, key_eps = jax.random.split(key)
    cond, x_0 = examples(config, key_examples, batch)
    network: Any = SamplerNetwork(config.network)

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        return network.apply(params, x_t, t, cond)

    steps = config.network.num_train_timesteps
    return diffusion.eps_loss(key_eps, denoise, x_0, steps), {}


DIFFUSION = Family(
    "sampler", SamplerConfig, SamplerTraining, SamplerNetwork, fresh, draw, loss
)

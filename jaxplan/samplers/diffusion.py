"""The paper's sampler: tree-extension segments from a conditional diffusion model."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.config import SamplerConfig, SegmentConfig
from jaxplan.networks import Cond, SamplerNetwork
from jaxplan.planning.segment import Segment


def draw(
    config: SamplerConfig, params: dict, cond: Cond, keys: jax.Array, n: int
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
    config: SamplerConfig, params: dict, cond: Cond, steps: np.ndarray
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


def noise(config: SegmentConfig, keys: jax.Array, n: int, size: int) -> jax.Array:
    """Normal numbers [P, n, size] of the problems with keys [P], at the temperature."""
    normal = jax.vmap(lambda key: jax.random.normal(key, (n, size)))(keys)
    return config.temperature * normal


def segments(config: SegmentConfig, x_0: jax.Array, cond: Cond) -> Segment:
    """x_0 [P, n, size] as a Segment."""
    joints, steps = len(config.q_min), (config.step_min, config.step_max)
    direction, length = diffusion.decode(x_0, joints, *steps)
    if not config.tree_context:
        return Segment(direction, length)
    q = jnp.broadcast_to(cond.q[:, None], direction.shape)
    return Segment(direction, length, diffusion.decode_base(x_0, q))

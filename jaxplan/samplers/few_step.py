"""One to four steps from noise to segments, learned from the diffusion sampler.

The network's output is v (Salimans and Ho, arXiv 2202.00512), with which x_0 is well
conditioned at every noise step:

    x_0 = sqrt(abar) x_t - sqrt(1 - abar) v,    eps = sqrt(1 - abar) x_t + sqrt(abar) v

It says the x_0 at which the teacher's deterministic DDIM run ends, hence one step will do.
More of them go part of the way each, to noise steps between `noisiest` and 0.
"""

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.config import FewStepConfig
from jaxplan.networks import Cond
from jaxplan.planning.segment import Segment
from jaxplan.samplers.diffusion import denoiser, noise, segments


def draw(
    config: FewStepConfig, params: dict, cond: Cond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems in `num_inference_steps`; see `samplers.draw`."""
    steps = timesteps(config)
    velocity = denoiser(config, params, cond, steps)
    abar = jnp.asarray(diffusion.alphas_cumprod(config.num_train_timesteps))

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        return jnp.sqrt(1 - abar[t]) * x_t + jnp.sqrt(abar[t]) * velocity(x_t, t)

    x_0 = diffusion.ddim(
        denoise,
        noise(config, keys, n, config.size),
        config.num_train_timesteps,
        steps,
        clip=diffusion.bounds(len(config.q_min), config.tree_context),
    )
    return segments(config, x_0, cond)


def timesteps(config: FewStepConfig) -> np.ndarray:
    """Noise steps visited, falling from `noisiest` in equal parts: 4 steps of 96: 96 72 48 24."""
    count = config.num_inference_steps
    if not 1 <= count <= config.noisiest:
        raise ValueError(
            f"num_inference_steps is {count}, expected 1 to {config.noisiest}"
        )
    return config.noisiest * np.arange(count, 0, -1, dtype=np.int32) // count

"""The paper's sampler: tree-extension segments from a conditional diffusion model."""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan import diffusion
from jaxplan.config import SamplerConfig
from jaxplan.networks.sampler import Cond, SamplerNetwork
from jaxplan.planning.segment import Segment


def draw(
    config: SamplerConfig, params: dict, cond: Cond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems, in one batched DDIM run.

    The FiLM vectors of all noise steps are made first, once per problem: of the loop, only
    the denoiser itself is left. Un-jitted; the caller jits it with `config` and `n` static.

    Args:
        config: The network that `params` belongs to, and the number of DDIM steps.
        params: Weights.
        cond: Conditions with leading axis P.
        keys: Typed keys [P]. Problem p's segments depend on its own key and condition only.
        n: Segments per problem.

    Returns:
        Segment with direction [P, n, 7] and length [P, n] [rad].
    """
    network: Any = SamplerNetwork(config)
    steps = diffusion.timesteps(config.num_train_timesteps, config.num_inference_steps)
    stride = config.num_train_timesteps // config.num_inference_steps
    vector = network.apply(params, cond, method="cond")
    # Row k of the table belongs to t = k * stride ("leading" spacing).
    table = network.apply(params, vector, jnp.sort(steps)[:, None], method="film")

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        film = table[t // stride][:, None, :]
        return network.apply(params, x_t, film, method="denoise")

    joints = len(config.q_min)
    noise = jax.vmap(lambda key: jax.random.normal(key, (n, joints + 1)))(keys)
    x_0 = diffusion.ddim(
        denoise,
        noise,
        config.num_train_timesteps,
        config.num_inference_steps,
        clip=diffusion.bounds(joints),
    )
    return Segment(*diffusion.decode(x_0, config.step_min, config.step_max))

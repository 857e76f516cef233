"""The few-step sampler's loss: where the teacher's DDIM run ends, from points on its way.

Knowledge distillation (Luhman and Luhman, arXiv 2101.02388) with the whole run as input:
of one run of the teacher, each chosen x_t is an example with the same x_0.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.config import FewStepTraining
from jaxplan.learning.pretrained import Weights
from jaxplan.learning.sampler import Phases, perturb_targets
from jaxplan.learning.train_state import Params
from jaxplan.networks import SamplerNetwork
from jaxplan.samplers.diffusion import denoiser


def loss(
    config: FewStepTraining,
    teacher: Weights,
    params: Params,
    key: jax.Array,
    batch: Phases,
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Mean squared error of x_0 over the steps `config.learned_steps`."""
    key_targets, key_noise = jax.random.split(key)
    cond = perturb_targets(key_targets, batch.cond, config.target_noise)
    joints, total = len(config.network.q_min), config.network.num_train_timesteps
    x_T = jax.random.normal(key_noise, (len(cond.q), 1, config.network.size))
    steps = diffusion.timesteps(total, teacher.config.num_inference_steps)
    path, x_0 = diffusion.ddim_path(
        denoiser(teacher.config, teacher.params, cond, steps),
        x_T,
        total,
        steps,
        clip=diffusion.bounds(joints, config.network.tree_context),
    )
    learned = np.array(config.learned_steps, np.int32)
    x_t = path[np.searchsorted(-steps, -learned), :, 0]
    abar = jnp.asarray(diffusion.alphas_cumprod(total)[learned])[:, None, None]
    network: Any = SamplerNetwork(config.network)
    vector = network.apply(params, cond, method="cond")
    film = network.apply(params, vector, jnp.asarray(learned)[:, None], method="film")
    v = network.apply(params, x_t, film, method="denoise")
    out = jnp.sqrt(abar) * x_t - jnp.sqrt(1.0 - abar) * v
    error = jnp.mean((out - x_0[:, 0]) ** 2, axis=(1, 2))
    return jnp.mean(error), {
        f"error_{t}": value for t, value in zip(learned, error, strict=True)
    }

"""One to four steps from noise to segments, learned from the diffusion sampler.

The network's output is v (Salimans and Ho, arXiv 2202.00512), with which x_0 is well
conditioned at every noise step:

    x_0 = sqrt(abar) x_t - sqrt(1 - abar) v,    eps = sqrt(1 - abar) x_t + sqrt(abar) v

It says the x_0 at which the teacher's deterministic DDIM run ends, hence one step will do.
More of them go part of the way each, to noise steps between `noisiest` and 0.

It learns from the teacher by knowledge distillation (Luhman and Luhman, arXiv 2101.02388) with
the whole run as input: of one run of the teacher, each chosen x_t is an example with the same x_0.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.learning.sampler import Phases, SegmentTraining, perturb_targets
from jaxplan.learning.train_state import Params
from jaxplan.learning.weights import Weights
from jaxplan.networks import AnyCond, FewStepConfig, SamplerNetwork
from jaxplan.planning.segment import Segment
from jaxplan.ranges import Whole
from jaxplan.samplers.diffusion import denoiser, fresh
from jaxplan.samplers.family import Family
from jaxplan.samplers.segments import noise, segments


@dataclass(frozen=True, kw_only=True)
class FewStepTraining(SegmentTraining):
    """`python -m jaxplan.train few_step`."""

    name: str = "few_step"
    network: FewStepConfig = FewStepConfig()
    teacher: str = "jaxplan/pretrained"
    """Directory with the diffusion sampler's weights."""
    learned_steps: tuple[Whole, ...] = (96, 72, 48, 24)
    """Noise steps of the teacher's DDIM run from which its end is learned."""


def draw(
    config: FewStepConfig, params: dict, cond: AnyCond, keys: jax.Array, n: int
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


FEW_STEP = Family(
    "few_step",
    FewStepConfig,
    FewStepTraining,
    SamplerNetwork,
    fresh,
    draw,
    loss,
    teacher="sampler",
)

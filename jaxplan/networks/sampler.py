"""The diffusion sampler's network: condition, FiLM vectors, denoiser.

The FiLM vectors depend on the condition and the noise step only. `film` makes them once
for a phase, `denoise` uses them for all of its samples, and `__call__` is both in one.
"""

from dataclasses import dataclass
from typing import Literal

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.condition import AnyCond, SegmentConfig, condition_of
from jaxplan.networks.film_mlp import FilmMlp
from jaxplan.networks.mish import mish
from jaxplan.networks.mlp import mlp
from jaxplan.networks.unet1d import ConditionalUnet1D
from jaxplan.ranges import Count, Whole


@dataclass(frozen=True)
class SamplerConfig(SegmentConfig):
    """The diffusion sampler D_theta (section 4.3)."""

    denoiser: Literal["unet1d", "film_mlp"] = "unet1d"
    hidden: tuple[Count, ...] = (64, 128, 256)
    """U-Net: channels of each level. FiLM-MLP: width of each block."""
    step_features: Count = 128
    num_train_timesteps: Count = 100
    num_inference_steps: Count = 25


@dataclass(frozen=True)
class FewStepConfig(SamplerConfig):
    """The diffusion sampler's noise-to-segment map in 1 to 4 steps, learned from it."""

    num_inference_steps: Count = 1
    noisiest: Whole = 96
    """Noise step from which x_T starts, as the teacher's: DDIM-25 begins there."""


class SamplerNetwork(nn.Module):
    """eps_theta(x_t, cond, t)."""

    config: SamplerConfig

    def setup(self) -> None:
        config = self.config
        self.condition = condition_of(config)
        self.step = mlp(4 * config.step_features, config.step_features)
        if config.denoiser == "unet1d":
            if config.size % 2 ** (len(config.hidden) - 1):
                raise ValueError(f"a U-Net of {config.size} numbers: see film_mlp")
            self.denoiser = ConditionalUnet1D(config.hidden)
        else:
            self.denoiser = FilmMlp(config.hidden, config.size)
        self.modulation = nn.Dense(sum(self.denoiser.film_sizes))

    def cond(self, cond: AnyCond) -> jax.Array:
        """The vector of a condition, [..., cond_features]."""
        return self.condition(cond)

    def film(self, cond: jax.Array, t: jax.Array) -> jax.Array:
        """FiLM vectors of all blocks, for cond [..., C] and noise steps t [...]."""
        step = self.step(sinusoidal(t, self.config.step_features))
        batch = jnp.broadcast_shapes(step.shape[:-1], cond.shape[:-1])
        both = [jnp.broadcast_to(v, (*batch, v.shape[-1])) for v in (step, cond)]
        return self.modulation(mish(jnp.concatenate(both, axis=-1)))

    def denoise(self, x_t: jax.Array, film: jax.Array) -> jax.Array:
        """eps for x_t [..., size], with film broadcastable to [..., F]."""
        sizes = self.denoiser.film_sizes
        ends = [sum(sizes[: i + 1]) for i in range(len(sizes) - 1)]
        films = jnp.split(film, ends, axis=-1)
        if self.config.denoiser == "unet1d":  # a channel of so many numbers
            return self.denoiser(x_t[..., None], films)[..., 0]
        return self.denoiser(x_t, films)

    def __call__(self, x_t: jax.Array, t: jax.Array, cond: AnyCond) -> jax.Array:
        """eps for x_t [..., size], t [...] and conditions [...]."""
        return self.denoise(x_t, self.film(self.cond(cond), t))


def sinusoidal(t: jax.Array, features: int) -> jax.Array:
    """Sine and cosine encoding of a noise step, `[...]` to `[..., features]`."""
    half = features // 2
    rates = jnp.exp(-jnp.log(10000.0) * jnp.arange(half) / (half - 1))
    angles = jnp.asarray(t, jnp.float32)[..., None] * rates
    return jnp.concatenate([jnp.sin(angles), jnp.cos(angles)], axis=-1)

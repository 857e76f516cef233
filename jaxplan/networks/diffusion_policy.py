"""Diffusion Policy, the convolutional one (Chi et al., RSS 2023): a U-Net over T actions."""

from dataclasses import dataclass

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.mish import mish
from jaxplan.networks.mlp import mlp
from jaxplan.networks.policy import PolicyConfig, Window, WindowEncoder
from jaxplan.networks.sampler import sinusoidal
from jaxplan.networks.unet1d import ConditionalUnet1D
from jaxplan.ranges import Count


@dataclass(frozen=True)
class DiffusionPolicyConfig(PolicyConfig):
    """Sizes; Diffusion Policy's own U-Net is (256, 512, 1024) with a kernel of 5."""

    widths: tuple[Count, ...] = (256, 512, 1024)
    """Channels of each level; the horizon must divide by 2^(levels - 1)."""
    kernel: Count = 5
    cond_features: Count = 256
    """Of each observation."""
    step_features: Count = 128
    num_train_timesteps: Count = 100
    num_inference_steps: Count = 16


class DiffusionPolicyNetwork(nn.Module):
    """eps_theta(x_t, window, t) over chunks of actions."""

    config: DiffusionPolicyConfig

    def setup(self) -> None:
        config = self.config
        self.window = WindowEncoder(config, config.cond_features)
        self.step = mlp(4 * config.step_features, config.step_features)
        self.denoiser = ConditionalUnet1D(config.widths, config.kernel)
        self.modulation = nn.Dense(sum(self.denoiser.film_sizes))

    def cond(self, window: Window) -> tuple[jax.Array, jax.Array | None]:
        """A window as one vector [..., H cond_features], and what it says of the camera."""
        each, error = self.window(window)
        return each.reshape(*each.shape[:-2], -1), error

    def denoise(self, x_t: jax.Array, t: jax.Array, cond: jax.Array) -> jax.Array:
        """eps for x_t [..., T, d + 1], noise steps t [...] and vectors cond [..., C]."""
        step = self.step(sinusoidal(t, self.config.step_features))
        step = jnp.broadcast_to(step, (*cond.shape[:-1], step.shape[-1]))
        film = self.modulation(mish(jnp.concatenate([step, cond], axis=-1)))
        sizes = self.denoiser.film_sizes
        ends = [sum(sizes[: i + 1]) for i in range(len(sizes) - 1)]
        return self.denoiser(x_t, jnp.split(film, ends, axis=-1))

    def __call__(self, window: Window) -> jax.Array:
        """Everything once, for initialisation."""
        cond, _ = self.cond(window)
        shape = *cond.shape[:-1], self.config.horizon, self.config.size
        return self.denoise(jnp.zeros(shape), jnp.zeros(cond.shape[:-1]), cond)

"""Diffusion Policy (Chi et al., RSS 2023): chunks of actions by denoising."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from jaxplan import diffusion
from jaxplan.learning.policy import Batch, PolicyTraining, examples, with_camera
from jaxplan.learning.train_state import Params
from jaxplan.networks import DiffusionPolicyConfig, DiffusionPolicyNetwork, Window
from jaxplan.policies.policy import Policy


@dataclass(frozen=True, kw_only=True)
class DiffusionPolicyTraining(PolicyTraining):
    """`python -m jaxplan.train diffusion_policy`."""

    name: str = "diffusion_policy"
    network: DiffusionPolicyConfig = DiffusionPolicyConfig()


def act(
    config: DiffusionPolicyConfig, params: Params, window: Window, keys: jax.Array
) -> jax.Array:
    """Chunks by DDIM, clipped to what demonstrations have."""
    network: Any = DiffusionPolicyNetwork(config)
    cond, _ = network.apply(params, window, method="cond")
    shape = config.horizon, config.size
    noise = jax.vmap(lambda key: jax.random.normal(key, shape))(keys)
    steps = diffusion.timesteps(config.num_train_timesteps, config.num_inference_steps)

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        return network.apply(params, x_t, t, cond, method="denoise")

    return diffusion.ddim(denoise, noise, config.num_train_timesteps, steps, clip=1.0)


def loss(
    config: DiffusionPolicyTraining, params: Params, key: jax.Array, batch: Batch
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Mean squared error of the noise on the chunk that follows each window."""
    key_image, key_eps = jax.random.split(key)
    window, x_0 = examples(config, key_image, batch)
    network: Any = DiffusionPolicyNetwork(config.network)
    cond, error = network.apply(params, window, method="cond")
    chunk = x_0[:, -1]

    def denoise(x_t: jax.Array, t: jax.Array) -> jax.Array:
        x_t = x_t.reshape(chunk.shape)
        eps = network.apply(params, x_t, t, cond, method="denoise")
        return eps.reshape(len(chunk), -1)

    steps = config.network.num_train_timesteps
    flat = chunk.reshape(len(chunk), -1)
    value = diffusion.eps_loss(key_eps, denoise, flat, steps)
    return with_camera(config, jnp.asarray(value), error, batch)


DIFFUSION_POLICY = Policy(
    "diffusion_policy",
    DiffusionPolicyConfig,
    DiffusionPolicyTraining,
    DiffusionPolicyNetwork,
    act,
    loss,
)

"""The eps-prediction objective (equation 5)."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Key

from jaxplan.diffusion.schedule import add_noise

Denoise = Callable[[jax.Array, jax.Array], jax.Array]
"""denoise(x_t, t) -> eps."""


def eps_loss(
    key: Key[Array, ""],
    denoise: Denoise,
    x_0: Float[Array, "B size"],
    num_train_timesteps: int,
) -> Float[Array, ""]:
    """Mean squared error of the noise, with t uniform and one draw per row of x_0."""
    key_t, key_eps = jax.random.split(key)
    t = jax.random.randint(key_t, x_0.shape[:-1], 0, num_train_timesteps)
    eps = jax.random.normal(key_eps, x_0.shape)
    x_t = add_noise(x_0, eps, t, num_train_timesteps)
    return jnp.mean((denoise(x_t, t) - eps) ** 2)

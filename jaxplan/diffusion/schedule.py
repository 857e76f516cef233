"""The cosine noise schedule and the forward process."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int


def squaredcos_cap_v2(num_train_timesteps: int) -> np.ndarray:
    """`betas` [T] of the squared-cosine schedule (Nichol and Dhariwal), capped at 0.999."""
    tau = np.arange(num_train_timesteps + 1) / num_train_timesteps
    alpha_bar = np.cos((tau + 0.008) / 1.008 * np.pi / 2) ** 2
    return np.minimum(1.0 - alpha_bar[1:] / alpha_bar[:-1], 0.999)


def alphas_cumprod(num_train_timesteps: int) -> np.ndarray:
    """Product of (1 - beta) up to each t, f32 [T]; float64 until the end."""
    betas = squaredcos_cap_v2(num_train_timesteps)
    return np.cumprod(1.0 - betas).astype(np.float32)


def add_noise(
    x_0: Float[Array, "*B size"],
    eps: Float[Array, "*B size"],
    t: Int[Array, "*B"],
    num_train_timesteps: int,
) -> Float[Array, "*B size"]:
    """x_t = sqrt(abar_t) x_0 + sqrt(1 - abar_t) eps."""
    abar = jnp.asarray(alphas_cumprod(num_train_timesteps))[t][..., None]
    return jnp.sqrt(abar) * x_0 + jnp.sqrt(1.0 - abar) * eps

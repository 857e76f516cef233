"""Deterministic DDIM sampling (eta = 0), with leading spacing and clipping.

With T = 100 and 25 steps, t runs 96, 92, ..., 4, 0. The very last noise step, 99, is left
out on purpose: there an error of eps enters x_0 two thousand times.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxplan.diffusion.loss import Denoise
from jaxplan.diffusion.schedule import alphas_cumprod


def timesteps(num_train_timesteps: int, num_inference_steps: int) -> np.ndarray:
    """Noise steps visited, from the noisiest to 0, i32 [num_inference_steps]."""
    if not 1 <= num_inference_steps <= num_train_timesteps:
        raise ValueError(
            f"num_inference_steps is {num_inference_steps}, "
            f"expected 1 to {num_train_timesteps}"
        )
    stride = num_train_timesteps // num_inference_steps
    return (np.arange(num_inference_steps, dtype=np.int32) * stride)[::-1].copy()


def ddim(
    denoise: Denoise,
    x_T: Float[Array, "*B size"],
    num_train_timesteps: int,
    steps: np.ndarray,
    clip: float | Float[Array, "..."] = jnp.inf,
) -> Float[Array, "*B size"]:
    """Carries noise x_T to a sample x_0 of the same shape.

    Args:
        denoise: (x_t, t) -> eps, with t an i32 scalar.
        x_T: Standard normal noise.
        num_train_timesteps: T of the schedule.
        steps: Noise steps visited, falling, as from `timesteps`.
        clip: Bound on |x_0|, broadcastable to x_0.
    """
    return ddim_path(denoise, x_T, num_train_timesteps, steps, clip)[1]


def ddim_path(
    denoise: Denoise,
    x_T: Float[Array, "*B size"],
    num_train_timesteps: int,
    steps: np.ndarray,
    clip: float | Float[Array, "..."] = jnp.inf,
) -> tuple[Float[Array, "steps *B size"], Float[Array, "*B size"]]:
    """The x_t of all steps, and x_0; arguments of `ddim`."""
    abar = alphas_cumprod(num_train_timesteps)[steps]
    abar_next = np.append(abar[1:], np.float32(1.0))

    def step(x_t: jax.Array, at: tuple) -> tuple[jax.Array, jax.Array]:
        t, abar, abar_next = at
        eps = denoise(x_t, t)
        x_0 = (x_t - jnp.sqrt(1.0 - abar) * eps) / jnp.sqrt(abar)
        x_0 = jnp.clip(x_0, -clip, clip)
        return jnp.sqrt(abar_next) * x_0 + jnp.sqrt(1.0 - abar_next) * eps, x_t

    rows = (jnp.asarray(steps), jnp.asarray(abar), jnp.asarray(abar_next))
    x_0, path = jax.lax.scan(step, x_T, rows)
    return path, x_0

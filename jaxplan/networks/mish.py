"""The Mish activation, with one exponential."""

import jax
import jax.numpy as jnp


def mish(x: jax.Array) -> jax.Array:
    """x tanh(softplus(x)), as x n / (n + 2) with n = e^x (e^x + 2).

    `jax.nn.mish` spends most of a small denoiser's time on its logarithm and tanh.
    """
    e = jnp.exp(jnp.minimum(x, 20.0))  # beyond that the ratio is 1 in float32
    n = e * (e + 2.0)
    return x * (n / (n + 2.0))

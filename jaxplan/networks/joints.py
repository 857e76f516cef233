"""Joints as the networks see them: [q_min, q_max] to [-1, 1]."""

import jax
import jax.numpy as jnp


def normalize(q: jax.Array, q_min: tuple, q_max: tuple) -> jax.Array:
    """Radians to [-1, 1], `[..., d]`."""
    low, high = jnp.array(q_min), jnp.array(q_max)
    return 2.0 * (q - low) / (high - low) - 1.0


def unnormalize(x: jax.Array, q_min: tuple, q_max: tuple) -> jax.Array:
    """[-1, 1] to radians, `[..., d]`."""
    low, high = jnp.array(q_min), jnp.array(q_max)
    return low + 0.5 * (x + 1.0) * (high - low)

"""A segment (u, s) as the vector x_0 that is diffused: every coordinate near unit scale.

Raw, s would have a standard deviation of 0.04 beside 0.38 of the coordinates of u, and
come out with the wrong spread.
"""

import jax
import jax.numpy as jnp

CLIP = 1.02
"""Bound on |x_0|, as a factor of the largest value a segment can take."""


def encode(
    direction: jax.Array, length: jax.Array, step_min: float, step_max: float
) -> jax.Array:
    """x_0 = [u sqrt(d); s mapped to [-1, 1]], `[..., d]` and `[...]` to `[..., d + 1]`."""
    centre, half = 0.5 * (step_min + step_max), 0.5 * (step_max - step_min)
    scaled = direction * jnp.sqrt(direction.shape[-1])
    return jnp.concatenate([scaled, ((length - centre) / half)[..., None]], axis=-1)


def decode(
    x_0: jax.Array, step_min: float, step_max: float
) -> tuple[jax.Array, jax.Array]:
    """Unit direction [..., d] and length [...] in [step_min, step_max] [rad]."""
    centre, half = 0.5 * (step_min + step_max), 0.5 * (step_max - step_min)
    u = x_0[..., :-1]
    direction = u / jnp.maximum(jnp.linalg.norm(u, axis=-1, keepdims=True), 1e-6)
    length = jnp.clip(centre + half * x_0[..., -1], step_min, step_max)
    return direction, length


def bounds(joints: int) -> jax.Array:
    """Largest |x_0| of a segment, times `CLIP`, [joints + 1]."""
    return CLIP * jnp.append(jnp.full(joints, jnp.sqrt(float(joints))), 1.0)

"""A segment (u, s) as the vector x_0 that is diffused: every coordinate near unit scale.

Raw, s would have a standard deviation of 0.04 beside 0.38 of the coordinates of u, and
come out with the wrong spread.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

CLIP = 1.02
"""Bound on |x_0|, as a factor of the largest value a segment can take."""
FARTHEST = 6.0
"""Bound on the base in x_0: a joint is that many times its typical distance off at most."""


def encode(
    direction: Float[Array, "*B d"],
    length: Float[Array, "*B"],
    step_min: float,
    step_max: float,
) -> Float[Array, "*B d+1"]:
    """x_0 = [u sqrt(d); s mapped to [-1, 1]]."""
    centre, half = 0.5 * (step_min + step_max), 0.5 * (step_max - step_min)
    scaled = direction * jnp.sqrt(direction.shape[-1])
    return jnp.concatenate([scaled, ((length - centre) / half)[..., None]], axis=-1)


def decode(
    x_0: Float[Array, "*B size"], joints: int, step_min: float, step_max: float
) -> tuple[Float[Array, "*B {joints}"], Float[Array, "*B"]]:
    """Unit direction, and length in [step_min, step_max] [rad]."""
    centre, half = 0.5 * (step_min + step_max), 0.5 * (step_max - step_min)
    u, s = x_0[..., :joints], x_0[..., joints]
    direction = u / jnp.maximum(jnp.linalg.norm(u, axis=-1, keepdims=True), 1e-6)
    length = jnp.clip(centre + half * s, step_min, step_max)
    return direction, length


def encode_base(
    base: Float[Array, "*B d"], q: Float[Array, "*B d"], spread: float
) -> Float[Array, "*B d"]:
    """What x_0 has of a base, beside q_curr [rad].

    `spread` is the typical distance between them in a joint [rad].
    """
    return (base - q) / spread


def decode_base(
    x_0: Float[Array, "*B size"], q: Float[Array, "*B d"], spread: float
) -> Float[Array, "*B d"]:
    """The base [rad] in x_0, beside q_curr [rad]."""
    return q + spread * x_0[..., q.shape[-1] + 1 :]


def bounds(joints: int, base: bool = False) -> Float[Array, " size"]:
    """Largest |x_0| of a segment, times `CLIP`, [joints + 1], or with its base [2 joints + 1]."""
    segment = CLIP * jnp.append(jnp.full(joints, jnp.sqrt(float(joints))), 1.0)
    return jnp.append(segment, jnp.full(joints, FARTHEST)) if base else segment

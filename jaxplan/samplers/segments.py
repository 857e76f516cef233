"""What all families end with: numbers of a network as segments."""

import jax
import jax.numpy as jnp

from jaxplan import diffusion
from jaxplan.networks import AnyCond, SegmentConfig
from jaxplan.planning.segment import Segment


def noise(config: SegmentConfig, keys: jax.Array, n: int, size: int) -> jax.Array:
    """Normal numbers [P, n, size] of the problems with keys [P], at the temperature."""
    normal = jax.vmap(lambda key: jax.random.normal(key, (n, size)))(keys)
    return config.temperature * normal


def segments(config: SegmentConfig, x_0: jax.Array, cond: AnyCond) -> Segment:
    """x_0 [P, n, size] as a Segment."""
    joints, steps = len(config.q_min), (config.step_min, config.step_max)
    direction, length = diffusion.decode(x_0, joints, *steps)
    if not config.tree_context:
        return Segment(direction, length)
    q = jnp.broadcast_to(cond.q[:, None], direction.shape)
    return Segment(direction, length, diffusion.decode_base(x_0, q, config.base_spread))

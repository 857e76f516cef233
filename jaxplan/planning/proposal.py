"""The mixture of Algorithm 1: learned segments, uniform segments and a small goal bias.

Everything random about expansion k of a problem comes from `fold_in(key, k)`, whether or not
it is used. So a result depends neither on the batch nor on how many proposals are checked
at a time.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.segment import Proposal, Segment, usable


class Draw(NamedTuple):
    """The random numbers of one expansion of P problems (a leading K where K at once)."""

    learned: jax.Array
    """`[P]` use_learned: ask the sampler."""
    goal: jax.Array
    """`[P]` a uniform proposal goes straight toward the goal instead."""
    q_rand: jax.Array
    """`[P, d]` uniform within the limits [rad]."""
    segment: Segment
    """UniformSegment: direction uniform on the sphere, length in [step_min, step_max]."""


def draw_numbers(
    keys: jax.Array,
    expansion: jax.Array,
    q_min: jax.Array,
    q_max: jax.Array,
    config: PlannerConfig,
) -> Draw:
    """The draws of expansions `[K, P]` of P problems with keys `[P]`."""

    def one(key, k):
        key_uniform, key_direction = jax.random.split(jax.random.fold_in(key, k))
        uniform = jax.random.uniform(key_uniform, (3 + q_min.size,))
        return uniform, jax.random.normal(key_direction, (q_min.size,))

    over_problems = jax.vmap(one)
    uniform, normal = jax.vmap(over_problems, (None, 0))(keys, expansion)
    length = config.step_min + uniform[..., 2] * (config.step_max - config.step_min)
    direction = normal / jnp.linalg.norm(normal, axis=-1, keepdims=True)
    return Draw(
        learned=uniform[..., 0] >= config.p_uniform,
        goal=uniform[..., 1] < config.goal_bias,
        q_rand=q_min + uniform[..., 3:] * (q_max - q_min),
        segment=Segment(direction, length),
    )


def mixture(
    draw: Draw,
    learned: jax.Array,
    segment: Segment,
    q_goal: jax.Array,
    config: PlannerConfig,
) -> tuple[Proposal, jax.Array]:
    """Chooses the proposal of one expansion (Algorithm 1, lines 8 to 15).

    A learned segment that is no move (not finite, no direction) gives way to the uniform
    proposal of the same expansion, so a broken sampler leaves plain RRT.

    Args:
        draw: The expansion's random numbers.
        learned: `[P]` whether this expansion uses the learned segment.
        segment: `[P]` next learned segments.
        q_goal: `[P, d]` root of the other tree, or the goal of the only one [rad].
        config: Planner settings.

    Returns:
        The proposal, and `[P]` whether it is a learned one.
    """
    learned = learned & usable(segment)
    to_goal = ~learned & draw.goal
    norm = jnp.linalg.norm(segment.direction, axis=-1, keepdims=True)
    length = jnp.clip(segment.length, config.step_min, config.step_max)
    at_goal, row = (learned | to_goal)[:, None], learned[:, None]
    proposal = Proposal(
        target=jnp.where(at_goal, q_goal, draw.q_rand),
        direction=jnp.where(row, segment.direction / norm, draw.segment.direction),
        length=jnp.where(learned, length, draw.segment.length),
        toward=~learned & (to_goal | (config.uniform_mode == "toward")),
    )
    return proposal, learned

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
from jaxplan.planning.space import norm, rounded


class Draw(NamedTuple):
    """The random numbers of one expansion of each of K workers of P problems."""

    learned: jax.Array
    """`[P, K]` use_learned: ask the sampler."""
    goal: jax.Array
    """`[P, K]` a uniform proposal goes straight toward the goal instead."""
    uniform: jax.Array
    """`[P, K, d]` in (0, 1): where q_rand lies in the box."""
    q_rand: jax.Array
    """`[P, K, d]` uniform within the box that is sampled [rad]."""
    share: jax.Array
    """`[P, K]` in (0, 1): the segment's length among those that there are."""
    segment: Segment
    """UniformSegment: direction uniform on the sphere, length in [step_min, step_max]."""


def draw_numbers(
    keys: jax.Array,
    expansion: jax.Array,
    box: tuple[jax.Array, jax.Array],
    config: PlannerConfig,
) -> Draw:
    """The random numbers of expansions `[P, K]` of the problems with keys `[P]`.

    Args:
        keys: `[P]` typed.
        expansion: `[P, K]` their numbers.
        box: Corners `[d]` or `[P, 1, d]` of what is sampled.
        config: Planner settings.
    """
    low, high = box
    d = low.shape[-1]

    def one(key, k):
        return jax.random.bits(jax.random.fold_in(key, k), (3 + 2 * d,))

    bits = jax.vmap(jax.vmap(one, (None, 0)))(keys, expansion)
    uniform = (bits >> 9).astype(jnp.float32) * 2.0**-23 + 2.0**-24  # inside (0, 1)
    normal = jax.scipy.special.ndtri(uniform[..., 3 + d :])
    span = config.step_max - config.step_min
    length = config.step_min + rounded(uniform[..., 2] * span)
    return Draw(
        learned=uniform[..., 0] >= config.p_uniform,
        goal=uniform[..., 1] < config.goal_bias,
        uniform=uniform[..., 3 : 3 + d],
        q_rand=low + rounded(uniform[..., 3 : 3 + d] * (high - low)),
        share=uniform[..., 2],
        segment=Segment(normal / norm(normal)[..., None], length),
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
    proposal of the same expansion, so a broken sampler leaves plain RRT. One that says
    where it begins is a move to its end.

    Args:
        draw: The expansion's random numbers.
        learned: `[P, K]` whether this expansion uses the learned segment.
        segment: `[P, K]` next learned segments.
        q_goal: `[P, K, d]`, or with one axis for all workers, the root of the other tree,
            or the goal of the only one [rad].
        config: Planner settings.

    Returns:
        The proposal, and `[P, K]` whether it is a learned one.
    """
    learned = learned & usable(segment)
    to_goal = ~learned & draw.goal
    scale = norm(segment.direction)[..., None]
    length = jnp.clip(segment.length, config.step_min, config.step_max)
    based, row = segment.base is not None, learned[..., None]
    end = segment.end if based else q_goal
    proposal = Proposal(
        target=jnp.where(row, end, jnp.where(to_goal[..., None], q_goal, draw.q_rand)),
        direction=jnp.where(row, segment.direction / scale, draw.segment.direction),
        length=jnp.where(learned, length, draw.segment.length),
        toward=jnp.where(learned, based, to_goal | (config.uniform_mode == "toward")),
    )
    return proposal, learned

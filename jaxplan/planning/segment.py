"""Tree-extension segments (u, s) and the one form in which every planner proposes.

    sampler             target   direction   toward
    classical RRT       q_rand   -           yes
    goal bias           q_goal   -           yes
    learned segment     q_goal   u           no
      with a base       its end  -           yes
    UniformSegment      q_rand   uniform     no

The base is the node nearest to `target`; the move goes `length` from it, along
`direction`, or straight at the target where `toward` is set.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.planning.space import Space, norm, rounded

SNAP = 1.0001
"""A target this share of a step away is reached: without it, a straight motion of a whole
number of steps would end on the rounding of its last step."""


class Segment(NamedTuple):
    """Direction u and step length s of a tree extension (section 4.3)."""

    direction: jax.Array
    """`[..., d]`, of any length above zero."""
    length: jax.Array
    """`[...]` [rad]."""
    base: jax.Array | None = None
    """`[..., d]` where the segment is meant to begin [rad]; None = wherever the base is."""

    @property
    def end(self) -> jax.Array:
        """`[..., d]` where a segment with a base is meant to lead [rad]."""
        assert self.base is not None
        scale = norm(self.direction)[..., None]
        return self.base + rounded(self.length[..., None] * self.direction / scale)

    def reversed(self) -> "Segment":
        """The way back."""
        base = None if self.base is None else self.end
        return Segment(-self.direction, self.length, base)


DrawBank = Callable[[jax.Array], Segment]
"""Learned segments of P problems: bank number `[P]` to its M segments, `[P, M]`."""


class Proposal(NamedTuple):
    """One move for each of K workers of P problems."""

    target: jax.Array
    """`[P, K, d]` the base is the node nearest to it [rad]."""
    direction: jax.Array
    """`[P, K, d]` unit vector."""
    length: jax.Array
    """`[P, K]` [rad]."""
    toward: jax.Array
    """`[P, K]` the move goes to `target` and not along `direction`."""


def straightened(
    proposal: Proposal, connecting: jax.Array, q_aim: jax.Array, step: float
) -> Proposal:
    """The proposal, but where `connecting [P, K]` a straight move of `step` to `q_aim`."""
    return Proposal(
        target=jnp.where(connecting[..., None], q_aim, proposal.target),
        direction=proposal.direction,
        length=jnp.where(connecting, step, proposal.length),
        toward=connecting | proposal.toward,
    )


def usable(segment: Segment) -> jax.Array:
    """Which segments are a move at all: finite, with a direction other than zero."""
    length = norm(segment.direction)
    moves = jnp.isfinite(length) & (length > 1e-6) & jnp.isfinite(segment.length)
    if segment.base is None:
        return moves
    return moves & jnp.all(jnp.isfinite(segment.base), axis=-1)


def extend(
    q_base: jax.Array, proposal: Proposal, space: Space
) -> tuple[jax.Array, jax.Array]:
    """Carries out a proposal from its base (equation 4, with the projection to limits).

    Args:
        q_base: `[P, K, d]` [rad].
        proposal: Moves, one for each row of `q_base`.
        space: Limits, and which joints come round.

    Returns:
        `q_new [P, K, d]`, and `reached [P, K]`: whether it is the target, to the last bit; or
        in joints that come round, some turns from it.
    """
    gap = space.gap(q_base, proposal.target)
    distance = norm(gap)
    reached = proposal.toward & (distance <= SNAP * proposal.length)
    straight = gap / jnp.maximum(distance, 1e-9)[..., None]
    direction = jnp.where(proposal.toward[..., None], straight, proposal.direction)
    q_new = space.project(q_base + rounded(proposal.length[..., None] * direction))
    target = proposal.target
    if space.turns:
        target = jnp.where(np.array(space.circular), q_base + gap, target)
    return jnp.where(reached[..., None], target, q_new), reached

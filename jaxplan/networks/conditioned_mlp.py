"""An MLP of (x, cond): what the feed-forward samplers are made of."""

from collections.abc import Callable

import flax.linen as nn
import jax


class ConditionedMlp(nn.Module):
    """The first layer is split, so that cond's share is computed once for all its x."""

    hidden: tuple[int, ...]
    outputs: int
    activation: Callable[[jax.Array], jax.Array]

    @nn.compact
    def __call__(self, x: jax.Array, cond: jax.Array) -> jax.Array:
        """`x` [..., X], `cond` broadcastable to [..., C]; [..., outputs]."""
        first, *more = self.hidden
        h = nn.Dense(first)(x) + nn.Dense(first, use_bias=False)(cond)
        for width in more:
            h = nn.Dense(width)(self.activation(h))
        return nn.Dense(self.outputs)(self.activation(h))

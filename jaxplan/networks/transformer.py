"""Transformer: robomimic's BC-Transformer, with a head that says chunks of actions.

Which transformer the paper compares with its reference does not say: this is the one that comes
from the same code base as its LSTM-GMM.
"""

from dataclasses import dataclass

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.mixture import Mixture, MixtureHead
from jaxplan.networks.policy import WINDOW, PolicyConfig, Window, WindowEncoder
from jaxplan.ranges import Count, Positive, Probability


@dataclass(frozen=True)
class TransformerConfig(PolicyConfig):
    """Sizes; robomimic's."""

    history: Count = 10
    layers: Count = 6
    width: Count = 512
    heads: Count = 8
    dropout: Probability = 0.1
    modes: Count = 5
    min_std: Positive = 1e-2
    """In chunks' units, as for LSTM-GMM."""


class TransformerNetwork(nn.Module):
    """A mixture of chunks for each observation of a window, from it and those before it."""

    config: TransformerConfig

    @nn.compact
    def __call__(
        self, window: Window, train: bool = False
    ) -> tuple[Mixture, jax.Array | None]:
        """`[..., H, ...]`, and what the pictures say of the camera [..., H, 5]."""
        config = self.config

        def drop(h: jax.Array) -> jax.Array:
            return nn.Dropout(config.dropout, deterministic=not train)(h)

        h, error = WindowEncoder(config, config.width, name=WINDOW)(window)
        places = nn.initializers.normal(0.02)
        h = drop(h + self.param("places", places, (config.history, config.width)))
        past = nn.make_causal_mask(jnp.ones(h.shape[:-1]))
        for _ in range(config.layers):
            attention = nn.MultiHeadDotProductAttention(
                config.heads, dropout_rate=config.dropout, deterministic=not train
            )
            h = h + drop(attention(nn.LayerNorm()(h), mask=past))
            inner = nn.gelu(nn.Dense(4 * config.width)(nn.LayerNorm()(h)))
            h = h + drop(nn.Dense(config.width)(inner))
        head = MixtureHead(
            config.modes, config.horizon, len(config.q_min), config.min_std
        )
        return head(nn.LayerNorm()(h)), error

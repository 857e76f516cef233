"""LSTM-GMM: robomimic's BC-RNN-GMM (Mandlekar et al., CoRL 2021), saying chunks of actions."""

from dataclasses import dataclass
from typing import Any

import flax.linen as nn
import jax

from jaxplan.networks.mixture import Mixture, MixtureHead
from jaxplan.networks.policy import WINDOW, PolicyConfig, Window, WindowEncoder
from jaxplan.ranges import Count, Positive


@dataclass(frozen=True)
class LstmGmmConfig(PolicyConfig):
    """Sizes; robomimic's for images."""

    history: Count = 10
    """The LSTM begins anew with each window, in training and after it."""
    observation_features: Count = 256
    layers: Count = 2
    width: Count = 1000
    modes: Count = 5
    min_std: Positive = 1e-2
    """In chunks' units; robomimic's 1e-4 makes a likelihood of whole chunks explode."""


class LstmGmmNetwork(nn.Module):
    """A mixture of chunks for each observation of a window, from it and those before it."""

    config: LstmGmmConfig

    @nn.compact
    def __call__(self, window: Window) -> tuple[Mixture, jax.Array | None]:
        """`[..., H, ...]`, and what the pictures say of the camera [..., H, 5]."""
        config = self.config
        encoder = WindowEncoder(config, config.observation_features, name=WINDOW)
        h: Any
        h, error = encoder(window)
        for _ in range(config.layers):
            h = nn.RNN(nn.OptimizedLSTMCell(config.width))(h)
        head = MixtureHead(
            config.modes, config.horizon, len(config.q_min), config.min_std
        )
        return head(h), error

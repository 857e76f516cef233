"""The small layers that conditions go through."""

import flax.linen as nn

from jaxplan.networks.mish import mish


def mlp(hidden: int, outputs: int) -> nn.Sequential:
    """Two layers with Mish between them; for a module's `setup`."""
    return nn.Sequential([nn.Dense(hidden), mish, nn.Dense(outputs)])

"""How the feed-forward samplers, CVAE and GAN, draw: one pass from a latent to a segment."""

from typing import Any

import jax

from jaxplan.learning.sampler import Draw
from jaxplan.networks import AnyCond
from jaxplan.planning.segment import Segment
from jaxplan.samplers.segments import noise, segments


def one_pass(network: Any) -> Draw:
    """The family's `draw`, with a network that has `cond` and `generate`; z is normal."""

    def draw(
        config: Any, params: dict, cond: AnyCond, keys: jax.Array, n: int
    ) -> Segment:
        """`n` segments for each of P problems; see `samplers.draw`."""
        model = network(config)
        vector = model.apply(params, cond, method="cond")[:, None]
        z = noise(config, keys, n, config.latent)
        return segments(config, model.apply(params, z, vector, method="generate"), cond)

    return draw

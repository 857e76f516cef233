"""The feed-forward samplers, CVAE and GAN: one pass from a latent draw to a segment."""

from typing import Any

import jax

from jaxplan.config import CvaeConfig, GanConfig
from jaxplan.networks import Cond, network
from jaxplan.planning.segment import Segment
from jaxplan.samplers.diffusion import noise, segments


def draw(
    config: CvaeConfig | GanConfig, params: dict, cond: Cond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems; see `samplers.draw`. z is normal."""
    model: Any = network(config)
    vector = model.apply(params, cond, method="cond")[:, None]
    z = noise(config, keys, n, config.latent)
    return segments(config, model.apply(params, z, vector, method="generate"), cond)

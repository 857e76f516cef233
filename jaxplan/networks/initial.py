"""Fresh weights of any network, from its config."""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.config import (
    CvaeConfig,
    GanConfig,
    PredictorConfig,
    SamplerConfig,
    SegmentConfig,
)
from jaxplan.networks.condition import Cond
from jaxplan.networks.cvae import CvaeNetwork
from jaxplan.networks.gan import GanNetwork
from jaxplan.networks.predictor import Predictor
from jaxplan.networks.sampler import SamplerNetwork

NETWORKS: dict[type, Any] = {
    PredictorConfig: Predictor,
    CvaeConfig: CvaeNetwork,
    GanConfig: GanNetwork,
    SamplerConfig: SamplerNetwork,
}


def network(config: Any) -> Any:
    """The Flax module that a config describes.

    Raises:
        TypeError: It describes none.
    """
    for kind, module in NETWORKS.items():
        if isinstance(config, kind):
            return module(config)
    raise TypeError(f"{type(config).__name__} describes no network")


def init(
    config: PredictorConfig | SegmentConfig,
    key: jax.Array,
    image: tuple[int, ...],
    training: bool = True,
) -> Any:
    """Fresh weights.

    Args:
        config: What network.
        key: Random key.
        image: Shape of what it gets as an image: (88, 136, 3), or (F,) for features.
        training: Also what only training needs: the CVAE's recognition network, the GAN's
            discriminator.
    """
    model, joints = network(config), jnp.zeros((1, len(config.q_min)))
    pixels = jnp.zeros((1, *image), jnp.uint8 if len(image) == 3 else jnp.float32)
    mode = jnp.zeros(1, jnp.int32)
    if isinstance(config, PredictorConfig):
        return model.init(key, pixels, joints, mode)
    cond = Cond(pixels, joints, mode, joints, mode, joints)
    x_0 = jnp.zeros((1, config.size))
    if isinstance(config, CvaeConfig | GanConfig):
        z = jnp.zeros((1, config.latent))
        if not training:
            return model.init(key, z, cond, method="draw")
        return model.init(key, x_0 if isinstance(config, CvaeConfig) else z, cond)
    return model.init(key, x_0, mode, cond)

"""The registry of sampler families, and the doors that need not know which one it is."""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.learning.train_state import Params
from jaxplan.networks import Cond, SegmentConfig
from jaxplan.planning.segment import Segment
from jaxplan.samplers.cvae import CVAE
from jaxplan.samplers.diffusion import DIFFUSION
from jaxplan.samplers.family import Family
from jaxplan.samplers.few_step import FEW_STEP
from jaxplan.samplers.gan import GAN

FAMILIES: dict[str, Family] = {
    family.name: family for family in (DIFFUSION, FEW_STEP, CVAE, GAN)
}


def family_of(config: Any) -> Family:
    """The family whose networks a config describes.

    Raises:
        TypeError: There is none.
    """
    for family in FAMILIES.values():
        if type(config) is family.config:
            return family
    raise TypeError(f"{type(config).__name__} describes no sampler")


def init(
    config: SegmentConfig,
    key: jax.Array,
    image: tuple[int, ...],
    training: bool = True,
) -> Params:
    """Fresh weights.

    Args:
        config: What network.
        key: Random key.
        image: Shape of what it gets as an image: (88, 136, 3), or (F,) for features.
        training: Also what only training needs.
    """
    joints, mode = jnp.zeros((1, len(config.q_min))), jnp.zeros(1, jnp.int32)
    pixels = jnp.zeros((1, *image), jnp.uint8 if len(image) == 3 else jnp.float32)
    cond = Cond(pixels, joints, mode, joints, mode, joints)
    return family_of(config).fresh(config, key, cond, training)


def draw(
    config: SegmentConfig, params: dict, cond: Cond, keys: jax.Array, n: int
) -> Segment:
    """`n` segments for each of P problems, in one batch.

    Un-jitted; the caller jits it with `config` and `n` static.

    Args:
        config: The network that `params` belongs to; its type says which family.
        params: Weights.
        cond: Conditions with leading axis P.
        keys: Typed keys [P]. Problem p's segments depend on its own key and condition only.
        n: Segments per problem.

    Returns:
        Segment with direction [P, n, d], length [P, n] [rad], and with `tree_context` base.
    """
    return family_of(config).draw(config, params, cond, keys, n)

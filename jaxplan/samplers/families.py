"""The registry of sampler families, and the doors that need not know which one it is."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Key

from jaxplan.learning.train_state import Params
from jaxplan.networks import AnyCond, Cond, SceneCond, SegmentConfig
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
    key: Key[Array, ""],
    image: tuple[int, ...] = (),
    training: bool = True,
) -> Params:
    """Fresh weights.

    Args:
        config: What network.
        key: Random key.
        image: Shape of what it gets as an image: (88, 136, 3), or (F,) for features; nothing
            to a sampler of a scene.
        training: Also what only training needs.
    """
    return family_of(config).fresh(config, key, _blank(config, image), training)


def _blank(config: SegmentConfig, image: tuple[int, ...]) -> AnyCond:
    """A condition, for its shapes."""
    joints, mode = jnp.zeros((1, len(config.q_min))), jnp.zeros(1, jnp.int32)
    if (around := config.surroundings) is not None:
        things = jnp.zeros((1, min(around.thing, 1), around.thing))
        state = jnp.zeros((1, around.state))
        return SceneCond(joints, state, things, jnp.ones(things.shape[:2], bool))
    pixels = jnp.zeros((1, *image), jnp.uint8 if len(image) == 3 else jnp.float32)
    return Cond(pixels, joints, mode, joints, mode, joints)


def draw(
    config: SegmentConfig, params: dict, cond: AnyCond, keys: Key[Array, " P"], n: int
) -> Segment:
    """`n` segments for each of P problems, in one batch.

    Un-jitted; the caller jits it with `config` and `n` static.

    Args:
        config: The network that `params` belongs to; its type says which family.
        params: Weights.
        cond: Conditions with leading axis P.
        keys: Problem p's segments depend on its own key and condition only.
        n: Segments per problem.

    Returns:
        Segment with direction [P, n, d], length [P, n] [rad], and with `tree_context` base.
    """
    return family_of(config).draw(config, params, cond, keys, n)

"""The registry of policies, and the doors that need not know which one it is."""

from typing import Any

import jax
import jax.numpy as jnp

from jaxplan.data import IMAGE_SHAPE
from jaxplan.learning.train_state import Params
from jaxplan.networks import PolicyConfig, Window
from jaxplan.policies.diffusion_policy import DIFFUSION_POLICY
from jaxplan.policies.lstm_gmm import LSTM_GMM
from jaxplan.policies.policy import Policy
from jaxplan.policies.transformer import TRANSFORMER

POLICIES: dict[str, Policy] = {
    policy.name: policy for policy in (DIFFUSION_POLICY, LSTM_GMM, TRANSFORMER)
}


def policy_of(config: Any) -> Policy:
    """The policy whose network a config describes.

    Raises:
        TypeError: There is none.
    """
    for policy in POLICIES.values():
        if type(config) is policy.config:
            return policy
    raise TypeError(f"{type(config).__name__} describes no policy")


def init(config: PolicyConfig, key: jax.Array) -> Params:
    """Fresh weights."""
    one = 1, config.history
    window = Window(
        jnp.zeros((*one, *IMAGE_SHAPE), jnp.uint8),
        jnp.zeros((*one, len(config.q_min))),
        jnp.zeros(one, jnp.int32),
    )
    return policy_of(config).network(config).init(key, window)

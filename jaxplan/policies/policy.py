"""What a policy consists of."""

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxplan.learning.policy import Act, PolicyTraining
from jaxplan.networks import PolicyConfig


class Policy(NamedTuple):
    """One kind of imitation policy: a file of its own, and a line in `policies.POLICIES`."""

    name: str
    """As commands, configs and weights have it."""
    config: type[PolicyConfig]
    """Of its network."""
    training: type[PolicyTraining]
    """Settings of `python -m jaxplan.train NAME`."""
    network: Any
    """The Flax module that a config describes; called with a window it makes its weights."""
    act: Act
    """Un-jitted; who calls jits it with `config` static."""
    loss: Callable[..., Any]
    """`(config, params, key, batch) -> (loss, metrics)`."""

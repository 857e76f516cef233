"""What a family of samplers consists of."""

from collections.abc import Callable
from typing import Any, NamedTuple

from jaxplan.learning.sampler import Draw, SegmentTraining
from jaxplan.learning.train_state import Params
from jaxplan.networks import SegmentConfig


class Family(NamedTuple):
    """One kind of learned sampler: a file of its own, and a line in `samplers.FAMILIES`."""

    name: str
    """As commands, configs and weights have it."""
    config: type[SegmentConfig]
    """Of its network."""
    training: type[SegmentTraining]
    """Settings of `python -m jaxplan.train NAME`."""
    network: Any
    """The Flax module that a config describes."""
    fresh: Callable[..., Params]
    """`(config, key, cond, training) -> params`; `training`: also what only training needs."""
    draw: Draw
    """Un-jitted; who calls jits it with `config` and `n` static."""
    loss: Callable[..., Any]
    """`(config, [teacher,] params, key, batch) -> (loss, metrics)`."""
    teacher: str | None = None
    """Of which family it learns; None = of demonstrations alone."""

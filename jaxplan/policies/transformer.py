"""Transformer: robomimic's BC-Transformer with a head for chunks; the paper does not say which."""

from dataclasses import dataclass

import jax

from jaxplan.learning.policy import Batch, PolicyTraining
from jaxplan.learning.train_state import Params
from jaxplan.networks import TransformerConfig, TransformerNetwork
from jaxplan.policies.mixtures import draw_with, negative_log_likelihood
from jaxplan.policies.policy import Policy


@dataclass(frozen=True, kw_only=True)
class TransformerTraining(PolicyTraining):
    """`python -m jaxplan.train transformer`."""

    name: str = "transformer"
    network: TransformerConfig = TransformerConfig()


def loss(
    config: TransformerTraining, params: Params, key: jax.Array, batch: Batch
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Negative log likelihood of a chunk's number, with dropout."""
    return negative_log_likelihood(
        TransformerNetwork, config, params, key, batch, train=True
    )


TRANSFORMER = Policy(
    "transformer",
    TransformerConfig,
    TransformerTraining,
    TransformerNetwork,
    draw_with(TransformerNetwork),
    loss,
)

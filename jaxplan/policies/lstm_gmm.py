"""LSTM-GMM: robomimic's BC-RNN-GMM (Mandlekar et al., CoRL 2021), saying chunks of actions."""

from dataclasses import dataclass

import jax

from jaxplan.learning.policy import Batch, PolicyTraining
from jaxplan.learning.train_state import Params
from jaxplan.networks import LstmGmmConfig, LstmGmmNetwork
from jaxplan.policies.mixtures import draw_with, negative_log_likelihood
from jaxplan.policies.policy import Policy


@dataclass(frozen=True, kw_only=True)
class LstmGmmTraining(PolicyTraining):
    """`python -m jaxplan.train lstm_gmm`."""

    name: str = "lstm_gmm"
    network: LstmGmmConfig = LstmGmmConfig()


def loss(
    config: LstmGmmTraining, params: Params, key: jax.Array, batch: Batch
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Negative log likelihood of a chunk's number."""
    return negative_log_likelihood(LstmGmmNetwork, config, params, key, batch)


LSTM_GMM = Policy(
    "lstm_gmm",
    LstmGmmConfig,
    LstmGmmTraining,
    LstmGmmNetwork,
    draw_with(LstmGmmNetwork),
    loss,
)

"""The upper network, from demonstrations to exported weights."""

import logging
from functools import partial
from pathlib import Path

import jax
import numpy as np

from jaxplan import learning
from jaxplan.data import Shard
from jaxplan.learning import PredictorTraining, predictor
from jaxplan.pretrained import UPPER
from jaxplan.trainings import files

logger = logging.getLogger(__name__)


def train_predictor(config: PredictorTraining) -> Path:
    """Trains it; returns the weights' path."""
    shard, origin = files.read(config, Shard)
    logger.info("%d frames of %d episodes", len(shard.q), len(shard.episode_seed))
    rows, val_rows = files.split(np.arange(len(shard.q)), shard.seed, config)
    key = jax.random.key(config.seed)
    gather = partial(predictor.gather, shard)
    fresh = predictor.init(config.network, key, gather(rows[:1]))
    state, metrics = learning.fit(
        config,
        files.RUNS / config.name,
        files.initial(config, UPPER, fresh),
        partial(predictor.loss, config),
        rows,
        gather,
        predictor.validation(config.network, shard, val_rows),
        origin,
    )
    return files.export(config, UPPER, state.ema_params, metrics, origin)

"""An imitation policy, from timed demonstrations to exported weights."""

import dataclasses
import logging
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxplan import learning
from jaxplan.data import TimedShard
from jaxplan.learning import policy
from jaxplan.learning.policy import PolicyTraining
from jaxplan.learning.train_state import Params
from jaxplan.policies import Policy, init
from jaxplan.trainings import files

logger = logging.getLogger(__name__)


def train_policy(kind: Policy, config: PolicyTraining) -> Path:
    """Trains it; returns the weights' path."""
    shard, origin = files.read(config, TimedShard)
    logger.info("%d frames of %d episodes", len(shard.q), len(shard.episode_seed))
    config = dataclasses.replace(config, network=policy.fitted(config.network, shard))
    rows, val_rows = files.split(np.arange(len(shard.q)), shard.seed, config)
    loss, gather = partial(kind.loss, config), policy.Windows(shard, config.network)
    key = jax.random.key(config.seed)
    fresh = jax.jit(init, static_argnums=0)(config.network, key)
    state, metrics = learning.fit(
        config,
        files.RUNS / config.name,
        files.initial(config, kind.name, fresh),
        loss,
        policy.weighted(config, shard, rows),
        gather,
        policy.validation(config, kind.act, loss, gather, val_rows),
        origin,
        export=partial(_snapshot, config, kind.name, origin),
    )
    return files.export(config, kind.name, state.ema_params, metrics, origin)


def _snapshot(
    config: PolicyTraining,
    name: str,
    origin: dict[str, Any],
    step: int,
    params: Params,
    metrics: dict[str, float],
) -> None:
    """Weights on the way, whose success in closed loop says whether training has converged."""
    place = files.RUNS / config.name / "snapshots" / f"{step:06d}"
    here = dataclasses.replace(config, out=str(place))
    files.export(here, name, params, metrics, origin)

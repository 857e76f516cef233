"""An imitation policy, from timed demonstrations to exported weights."""

import dataclasses
import logging
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import learning, pretrained
from jaxplan.data import TimedShard
from jaxplan.learning import policy
from jaxplan.learning.command_line import UsageError
from jaxplan.learning.policy import PolicyTraining
from jaxplan.learning.train_state import Params
from jaxplan.networks import WINDOW, with_sight
from jaxplan.policies import Policy, init
from jaxplan.pretrained import UPPER
from jaxplan.trainings import files

logger = logging.getLogger(__name__)


def train_policy(kind: Policy, config: PolicyTraining) -> Path:
    """Trains it; returns the weights' path."""
    shard, origin = files.read(config, TimedShard)
    logger.info("%d frames of %d episodes", len(shard.q), len(shard.episode_seed))
    config = dataclasses.replace(config, network=policy.fitted(config.network, shard))
    rows, val_rows = files.split(np.arange(len(shard.q)), shard.seed, config)
    upper = None
    if config.sight is not None:
        upper = pretrained.load_weights(UPPER, config.sight)
        origin["sight_sha256"] = upper.info["sha256"]
        if config.encode_once:
            said = files.encoded(upper, shard.image, origin["data"])
            shard = shard._replace(image=said)
    loss, gather = partial(kind.loss, config), policy.Windows(shard, config.network)
    key = jax.random.key(config.seed)
    fresh = jax.jit(init, static_argnums=0)(config.network, key)
    state, metrics = learning.fit(
        config,
        files.RUNS / config.name,
        _initial(config, kind.name, fresh, upper),
        loss,
        policy.weighted(config, shard, rows),
        gather,
        policy.validation(config, kind.act, loss, gather, val_rows),
        origin,
        export=partial(_snapshot, config, kind.name, origin),
    )
    return files.export(config, kind.name, state.ema_params, metrics, origin)


def _initial(
    config: PolicyTraining, name: str, fresh: Params, upper: learning.Weights | None
) -> Params:
    """Weights to begin with: the predictor's sight, or all of an earlier policy.

    Raises:
        UsageError: They are of other sizes, or the encoder that stays as it is is another.
    """
    if upper is None:
        return files.initial(config, name, fresh)
    try:
        seeing = with_sight(fresh, jax.tree.map(jnp.asarray, upper.params))
    except KeyError as error:
        raise UsageError(
            f"the predictor in {config.sight} sees with other --network settings: "
            f"{error.args[0]}"
        ) from None
    params = files.initial(config, name, seeing)
    mine = params["params"][WINDOW]["encoder"], upper.params["params"]["encoder"]
    if config.encode_once and not all(map(np.array_equal, *map(jax.tree.leaves, mine))):
        raise UsageError(
            f"encode_once: {config.init} sees by another encoder than {config.sight}"
        )
    return params


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

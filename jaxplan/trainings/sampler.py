"""A learned sampler, from demonstrations of a task to exported weights."""

import logging
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jaxplan import learning, pretrained
from jaxplan.data import Shard
from jaxplan.learning import SegmentTraining, sampler, segments
from jaxplan.learning.command_line import UsageError
from jaxplan.learning.sampler import Gather
from jaxplan.pretrained import UPPER
from jaxplan.samplers import Family, init
from jaxplan.trainings import files

logger = logging.getLogger(__name__)


def train_sampler(family: Family, config: SegmentTraining) -> Path:
    """Trains it; returns the weights' path."""
    upper = None
    if config.network.encoder is None:
        upper = pretrained.load_weights(UPPER, config.predictor)
    shard, origin = files.read(config, Shard)
    logger.info("%d frames of %d episodes", len(shard.q), len(shard.episode_seed))
    image: Any = shard.image
    if upper is not None:
        image, _ = files.encoded(upper, image, origin["data"])
        origin["predictor_sha256"] = upper.info["sha256"]
    rows = segments.eligible(shard, config.network.step_min)
    gather = partial(sampler.gather, shard, image)
    parts = files.split(rows, shard.seed, config)
    return fit_family(family, config, gather, parts, image.shape[1:], origin)


def fit_family(
    family: Family,
    config: SegmentTraining,
    gather: Gather,
    rows: tuple[np.ndarray, np.ndarray],
    image: tuple[int, ...],
    origin: dict[str, Any],
) -> Path:
    """Trains a sampler on any data; returns the weights' path.

    Args:
        family: What kind.
        config: Its settings.
        gather: Rows to their batch.
        rows: To train on, and held out.
        image: Shape of what it gets as an image, see `samplers.init`.
        origin: Of the data and of the networks that had a part in it.

    Raises:
        UsageError: The teacher sees other conditions than the pupil, or says other things.
    """
    teacher = _teacher(family, config, origin)
    if teacher is not None:
        origin = origin | {"teacher_sha256": teacher.info["sha256"]}
    loss = partial(family.loss, config, *([] if teacher is None else [teacher]))
    fresh = jax.jit(init, static_argnums=(0, 2))(
        config.network, jax.random.key(config.seed), image
    )
    state, metrics = learning.fit(
        config,
        files.RUNS / config.name,
        files.initial(config, family.name, fresh),
        loss,
        rows[0],
        gather,
        sampler.validation(config, family.draw, loss, gather, rows[1]),
        origin,
    )
    return files.export(config, family.name, state.ema_params, metrics, origin)


def _teacher(
    family: Family, config: Any, origin: dict[str, Any]
) -> learning.Weights | None:
    """Whose pupil a family is, if it is one."""
    if family.teacher is None:
        return None
    teacher = pretrained.load_weights(family.teacher, config.teacher)
    if teacher.config.size != config.network.size:
        raise UsageError(
            f"the {family.teacher} in {config.teacher} has tree_context "
            f"{teacher.config.tree_context}, the pupil {config.network.tree_context}"
        )
    if teacher.info.get("predictor_sha256") != origin.get("predictor_sha256"):
        raise UsageError(
            f"the {family.teacher} in {config.teacher} was trained on another "
            "predictor's features"
        )
    if teacher.info.get("scene") != origin.get("scene"):
        raise UsageError(
            f"the {family.teacher} in {config.teacher} was trained for another scene"
        )
    return teacher

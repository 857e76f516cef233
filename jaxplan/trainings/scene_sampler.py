"""A learned sampler of a scene, from recorded paths (`jaxplan record`) to exported weights."""

import dataclasses
import logging
from functools import partial
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from jaxplan.data import PathShard
from jaxplan.learning import SegmentTraining
from jaxplan.learning.sampler import Phases
from jaxplan.learning.segments import PathRows
from jaxplan.networks import SceneCond, SurroundingsConfig
from jaxplan.samplers import Family
from jaxplan.trainings import files
from jaxplan.trainings.sampler import fit_family

SEGMENT: dict[str, Any] = {
    "encoder": None,
    "surroundings": SurroundingsConfig(),
    "tree_context": True,
    "step_min": 0.1,
    "step_max": 1.0,
    "base_spread": 1.0,
}
"""A planner's steps are longer than an episode's, and so are its ways."""
DENOISER: dict[str, Any] = {"denoiser": "film_mlp", "hidden": (256, 256, 256)}
COMMON: dict[str, Any] = {
    "data": ("data/cell",),
    "steps": 5000,
    "batch_size": 512,
    "log_every": 100,
}
TUNED: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "sampler": (DENOISER, {}),
    "few_step": (DENOISER, {"steps": 2500, "batch_size": 128}),
    "cvae": ({"latent": 8}, {"kl_weight": 0.01}),
    "gan": (
        {"generator": (256, 256, 256), "discriminator": (256, 256)},
        {"r1": 1.0, "instance_noise": 0.1},
    ),
}
"""By family: of its network and of its training what is not the default (`configs/compact.py`)."""

logger = logging.getLogger(__name__)


def settings(family: Family) -> SegmentTraining:
    """What a family is trained with for scenes, unless it is said otherwise."""
    default = family.training()  # pyright: ignore[reportCallIssue]
    network, training = TUNED.get(family.name, ({}, {}))
    return dataclasses.replace(
        default,
        name=f"scene_{family.name}",
        network=dataclasses.replace(default.network, **SEGMENT, **network),
        **(COMMON | training),
    )


def train_scene_sampler(family: Family, config: SegmentTraining) -> Path:
    """Trains it; returns the weights' path."""
    shard, origin = files.read(config, PathShard)
    logger.info("%d paths of %d problems", len(shard.problem), len(shard.posed))
    config = dataclasses.replace(config, network=fitted(config.network, shard))
    rows = np.flatnonzero(shard.path_length >= config.network.step_min)
    parts = files.split(rows, shard.problem, config)
    return fit_family(family, config, partial(gather, shard), parts, (), origin)


def gather(shard: PathShard, rows: np.ndarray) -> Phases:
    """Paths `rows`, from their starts on."""
    q, length = (jnp.asarray(x[rows]) for x in (shard.path_q, shard.path_length))
    known = (jnp.asarray(x[rows]) for x in (shard.state, shard.things, shard.there))
    return Phases(
        SceneCond(q[:, 0], *known), PathRows(q, length, jnp.zeros_like(length))
    )


def fitted(network: Any, shard: PathShard) -> Any:
    """With the sizes of the scene that the data is of."""
    count, thing = shard.things.shape[1:]
    around = dataclasses.replace(
        network.surroundings or SurroundingsConfig(),
        state=shard.state.shape[-1],
        thing=thing if count else 0,
    )
    low, high = (
        tuple(q((0, 1)).tolist()) for q in (shard.path_q.min, shard.path_q.max)
    )
    return dataclasses.replace(network, surroundings=around, q_min=low, q_max=high)

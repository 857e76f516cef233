"""What goes into a training and what comes out: data with its origin, weights before and after."""

import dataclasses
import hashlib
import logging
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import data, learning, pretrained
from jaxplan.learning import predictor
from jaxplan.learning.command_line import UsageError
from jaxplan.learning.loop import TrainConfig
from jaxplan.learning.train_state import Params
from jaxplan.learning.weights import merged
from jaxplan.networks import Encoding
from jaxplan.scene.identity import difference

logger = logging.getLogger(__name__)

RUNS = Path("runs")
"""Each run has a directory there."""


def read(config: TrainConfig, kind: type) -> tuple[Any, dict[str, Any]]:
    """All demonstrations; each directory's manifest checksum, and what was demonstrated where.

    Raises:
        DataError: They are missing, damaged, of another kind, or of several scenes.
    """
    shard = data.concatenate([data.read_demonstrations(d, kind) for d in config.data])
    hashes: dict[str, str] = {}
    for directory in map(Path, config.data):
        # By name: where a machine keeps its data says nothing to anybody else.
        name, number = directory.name, 1
        while name in hashes:
            number += 1
            name = f"{directory.name} ({number})"
        hashes[name] = data.sha256(directory / data.MANIFEST)
    settings = [data.read_manifest(d)["settings"] for d in config.data]
    return shard, {"data": hashes, **_shown(settings)}


def _shown(settings: list[dict[str, Any]]) -> dict[str, Any]:
    """Which scene, or which tasks, cameras, robots and objects."""
    if "scene" in settings[0]:
        scene = settings[0]["scene"]
        for each in settings:
            if differs := difference(each["scene"], scene):
                raise data.DataError(f"data of several scenes: {differs}")
        return {"scene": scene, "encoding": settings[0]["encoding"]}
    shown = {
        f"{kind}s": sorted({each[kind] for each in settings if kind in each})
        for kind in ("task", "camera", "robot")
    }
    return shown | {"objects": sorted({e.get("objects", "one") for e in settings})}


def split(
    rows: np.ndarray, seeds: np.ndarray, config: TrainConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Rows to train on and rows to validate on, neither empty; `seeds` are those of all rows.

    Raises:
        DataError: There are too few.
    """
    held = learning.held_out(seeds, config.val_fraction)
    train, val = rows[~held[rows]], rows[held[rows]]
    if not len(train) or not len(val):
        raise data.DataError(
            f"{len(train)} rows to train on and {len(val)} held out: collect more"
        )
    return train, val


def encoded(
    upper: learning.Weights, image: np.ndarray, hashes: dict[str, str]
) -> Encoding:
    """What the predictor's encoder says of all pictures, kept for the next training.

    Args:
        upper: The predictor.
        image: u8 [N, 88, 136, 3].
        hashes: Checksums of the data that they are of.
    """
    of = hashlib.sha256("".join([upper.info["sha256"], *hashes.values()]).encode())
    path = RUNS / "encodings" / f"{of.hexdigest()[:16]}.npz"
    if path.is_file():
        try:
            with np.load(path, allow_pickle=False) as archive:
                return Encoding(*(archive[name] for name in Encoding._fields))
        except Exception as error:  # a broken archive raises nearly anything
            logger.warning("%s is damaged (%s): made again", path, error)
    logger.info("what the encoder says of %d frames, once", len(image))
    found = predictor.encodings(upper.config, upper.params, image)
    data.write_npz(path, found._asdict())
    return found


def initial(config: TrainConfig, network: str, fresh: Params) -> Params:
    """The weights that `config.init` names, if it does, in place of the fresh ones.

    Raises:
        UsageError: They are of another network.
    """
    if config.init is None:
        return fresh
    weights = pretrained.load_weights(network, config.init)
    try:
        return merged(fresh, jax.tree.map(jnp.asarray, weights.params))
    except KeyError as error:
        layer = "/".join(error.args[0])
        raise UsageError(
            f"{config.init} holds a {network} with other --network settings: see {layer}"
        ) from None


def export(
    config: Any,
    network: str,
    params: dict,
    metrics: dict[str, float],
    origin: dict[str, Any],
) -> Path:
    """Writes the weights; returns their path."""
    directory = RUNS / config.name / "weights" if config.out is None else config.out
    training = dataclasses.asdict(dataclasses.replace(config, out=None))
    training.pop("network")  # `save_weights` records it
    for paths in ("data", "init", "predictor", "teacher", "sight"):
        training.pop(paths, None)  # the checksums say it without a machine's paths
    info = {"metrics": metrics, "training": training, **origin}
    return pretrained.save_weights(directory, network, params, config.network, info)

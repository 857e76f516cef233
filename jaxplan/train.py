"""`python -m jaxplan.train KIND --config configs/NAME.py [--overrides]`.

KIND is predictor; sampler (diffusion), cvae, gan or few_step; or diffusion_policy, lstm_gmm or
transformer.

Trains one network from demonstrations to exported weights. Started again, it goes on from
the run's newest checkpoint. `--help` lists every setting.
"""

import dataclasses
import hashlib
import logging
import sys
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import data, learning, pretrained
from jaxplan.learning import policy, predictor, sampler, segments
from jaxplan.learning.command_line import UsageError, parse
from jaxplan.learning.loop import TrainConfig
from jaxplan.learning.policy import PolicyTraining
from jaxplan.learning.predictor import PredictorTraining
from jaxplan.learning.sampler import SegmentTraining
from jaxplan.learning.train_state import Params
from jaxplan.learning.weights import merged
from jaxplan.policies import POLICIES, Policy
from jaxplan.policies import init as init_policy
from jaxplan.pretrained import UPPER
from jaxplan.process import BAD_INPUT, exit_code
from jaxplan.samplers import FAMILIES, Family, init

Training = PredictorTraining | SegmentTraining | PolicyTraining
RUNS = Path("runs")

logger = logging.getLogger(__name__)


def kinds() -> dict[str, type]:
    """What can be trained, and the class of its settings."""
    learned = (*FAMILIES.values(), *POLICIES.values())
    return {UPPER: PredictorTraining, **{each.name: each.training for each in learned}}


def main(arguments: list[str] | None = None) -> int:
    """Runs the command; 0 when done, 2 for bad input, 1 when training diverged."""
    # By force: a library has put its own handler there, which shows warnings only.
    logging.basicConfig(level=logging.INFO, format="%(message)s", force=True)
    logging.getLogger("absl").setLevel(logging.WARNING)
    try:
        config = parse(sys.argv[1:] if arguments is None else arguments, kinds())
        data.check_writable(RUNS, True, "the directory of runs,")
        data.check_writable(config.out or RUNS, True, "--out")
        if isinstance(config, PredictorTraining):
            path = train_predictor(config)
        else:
            name = {kind: name for name, kind in kinds().items()}[type(config)]
            if isinstance(config, PolicyTraining):
                path = train_policy(POLICIES[name], config)
            else:
                path = train_sampler(FAMILIES[name], config)
        logger.info("weights: %s", path)
        return 0
    except learning.TrainingDiverged as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return exit_code(error)
    except ValueError as error:
        known = (
            UsageError,
            data.DataError,
            data.UnwritableError,
            learning.WeightsError,
            learning.CheckpointError,
            learning.RunError,
        )
        if not isinstance(error, known):
            raise
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT


def train_predictor(config: PredictorTraining) -> Path:
    """Trains the upper network and exports it; returns the weights' path."""
    shard, origin = _read(config)
    held = learning.held_out(shard.seed, config.val_fraction)
    rows, val_rows = _split(np.arange(len(shard.q)), held)
    key = jax.random.key(config.seed)
    gather = partial(predictor.gather, shard)
    state, metrics = learning.fit(
        config,
        RUNS / config.name,
        _initial(config, UPPER, predictor.init(config.network, key, gather(rows[:1]))),
        partial(predictor.loss, config),
        rows,
        gather,
        predictor.validation(config.network, shard, val_rows),
        origin,
    )
    return _export(config, UPPER, state.ema_params, metrics, origin)


def train_sampler(family: Family, config: SegmentTraining) -> Path:
    """Trains a learned sampler and exports it; returns the weights' path."""
    upper = None
    if config.network.encoder is None:
        upper = pretrained.load_weights(UPPER, config.predictor)
    teacher = _teacher(family, config, upper)
    loss = partial(family.loss, config, *([] if teacher is None else [teacher]))
    shard, origin = _read(config)
    image = shard.image if upper is None else _features(upper, shard, origin["data"])
    for name, weights in (("predictor", upper), ("teacher", teacher)):
        if weights is not None:
            origin[f"{name}_sha256"] = weights.info["sha256"]
    held = learning.held_out(shard.seed, config.val_fraction)
    rows, val_rows = _split(segments.eligible(shard, config.network.step_min), held)
    fresh = jax.jit(init, static_argnums=(0, 2))(
        config.network, jax.random.key(config.seed), image.shape[1:]
    )
    state, metrics = learning.fit(
        config,
        RUNS / config.name,
        _initial(config, family.name, fresh),
        loss,
        rows,
        partial(sampler.gather, shard, image),
        sampler.validation(config, family.draw, loss, shard, image, val_rows),
        origin,
    )
    return _export(config, family.name, state.ema_params, metrics, origin)


def train_policy(kind: Policy, config: PolicyTraining) -> Path:
    """Trains an imitation policy and exports it; returns the weights' path."""
    shard, origin = _read(config, data.TimedShard)
    config = dataclasses.replace(config, network=policy.fitted(config.network, shard))
    held = learning.held_out(shard.seed, config.val_fraction)
    rows, val_rows = _split(np.arange(len(shard.q)), held)
    loss, gather = partial(kind.loss, config), policy.Windows(shard, config.network)
    key = jax.random.key(config.seed)
    fresh = jax.jit(init_policy, static_argnums=0)(config.network, key)
    state, metrics = learning.fit(
        config,
        RUNS / config.name,
        _initial(config, kind.name, fresh),
        loss,
        policy.weighted(config, shard, rows),
        gather,
        policy.validation(config, kind.act, loss, gather, val_rows),
        origin,
        export=partial(_snapshot, config, kind.name, origin),
    )
    return _export(config, kind.name, state.ema_params, metrics, origin)


def _teacher(
    family: Family, config: Any, upper: learning.Weights | None
) -> learning.Weights | None:
    """Whose pupil a family is, if it is one.

    Raises:
        UsageError: The teacher sees other conditions than the pupil, or says other things.
    """
    if family.teacher is None:
        return None
    teacher = pretrained.load_weights(family.teacher, config.teacher)
    if teacher.config.size != config.network.size:
        raise UsageError(
            f"the {family.teacher} in {config.teacher} has tree_context "
            f"{teacher.config.tree_context}, the pupil {config.network.tree_context}"
        )
    own = upper and upper.info["sha256"]
    if teacher.info.get("predictor_sha256") != own:
        raise UsageError(
            f"the {family.teacher} in {config.teacher} was trained on another "
            "predictor's features"
        )
    return teacher


def _read(config: TrainConfig, kind: type = data.Shard) -> tuple[Any, dict[str, Any]]:
    """All demonstrations; what they show, and each directory's manifest checksum."""
    shards = [data.read_demonstrations(directory, kind) for directory in config.data]
    shard = data.concatenate(shards)
    logger.info("%d frames of %d episodes", len(shard.q), len(shard.episode_seed))
    hashes: dict[str, str] = {}
    for directory in map(Path, config.data):
        # By name: where a machine keeps its data says nothing to anybody else.
        name, number = directory.name, 1
        while name in hashes:
            number += 1
            name = f"{directory.name} ({number})"
        hashes[name] = data.sha256(directory / "manifest.json")
    settings = [data.read_manifest(d)["settings"] for d in config.data]
    shown = {
        f"{kind}s": sorted({each[kind] for each in settings if kind in each})
        for kind in ("task", "camera", "robot")
    }
    shown["objects"] = sorted({each.get("objects", "one") for each in settings})
    return shard, {"data": hashes, **shown}


def _features(
    upper: learning.Weights, shard: data.Shard, hashes: dict[str, str]
) -> np.ndarray:
    """The predictor's image features of all frames, kept for the next sampler's training."""
    of = hashlib.sha256("".join([upper.info["sha256"], *hashes.values()]).encode())
    path = RUNS / "features" / f"{of.hexdigest()[:16]}.npz"
    if path.is_file():
        with np.load(path) as archive:
            return archive["features"]
    logger.info("image features of %d frames, once", len(shard.image))
    features = predictor.image_features(upper.config, upper.params, shard.image)
    data.write_npz(path, {"features": features})
    return features


def _split(rows: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows to train on and rows to validate on, neither empty."""
    train, val = rows[~held[rows]], rows[held[rows]]
    if not len(train) or not len(val):
        raise data.DataError(
            f"{len(train)} frames to train on and {len(val)} held out: collect more episodes"
        )
    return train, val


def _initial(config: Training, kind: str, fresh: Params) -> Params:
    """The weights that `config.init` names, if it does, in place of the fresh ones."""
    if config.init is None:
        return fresh
    weights = pretrained.load_weights(kind, config.init)
    try:
        return merged(fresh, jax.tree.map(jnp.asarray, weights.params))
    except KeyError as error:
        layer = "/".join(error.args[0])
        raise UsageError(
            f"{config.init} holds a {kind} with other --network settings: see {layer}"
        ) from None


def _snapshot(
    config: PolicyTraining,
    name: str,
    origin: dict[str, Any],
    step: int,
    params: Params,
    metrics: dict[str, float],
) -> None:
    """Weights on the way, whose success in closed loop says whether training has converged."""
    place = RUNS / config.name / "snapshots" / f"{step:06d}"
    _export(dataclasses.replace(config, out=str(place)), name, params, metrics, origin)


def _export(
    config: Training,
    kind: str,
    params: dict,
    metrics: dict[str, float],
    origin: dict[str, Any],
) -> Path:
    directory = RUNS / config.name / "weights" if config.out is None else config.out
    training = dataclasses.asdict(dataclasses.replace(config, out=None))
    training.pop("network")  # `save_weights` records it
    for paths in ("data", "init", "predictor", "teacher"):
        training.pop(paths, None)  # the checksums say it without a machine's paths
    info = {"metrics": metrics, "training": training, **origin}
    return pretrained.save_weights(directory, kind, params, config.network, info)


if __name__ == "__main__":
    sys.exit(main())

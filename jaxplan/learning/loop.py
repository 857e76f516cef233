"""The training loop: batches, logging, validation, checkpoints, exact resume."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.learning import checkpoint
from jaxplan.learning.data_parallel import Devices
from jaxplan.learning.run import Metrics, Progress, RunError, claimed
from jaxplan.learning.train_state import (
    Loss,
    OptimizerConfig,
    Params,
    TrainState,
    init_state,
    optimizer,
    train_step,
)
from jaxplan.ranges import Checked, Count, Probability, Whole


@dataclass(frozen=True, kw_only=True)
class TrainConfig(Checked):
    """What all trainings have in common."""

    name: str
    """The run's directory under `runs/`."""
    data: tuple[str, ...] = ("data/demonstrations",)
    """Directories of demonstrations."""
    out: str | None = None
    """Where the weights are exported when training ends; None = in the run's directory."""
    init: str | None = None
    """Directory of weights to start from, as after new demonstrations; None = fresh ones."""
    seed: Whole = 0
    steps: Whole = 100_000
    batch_size: Count = 64
    optimizer: OptimizerConfig = OptimizerConfig()
    val_fraction: Probability = 0.05
    """Share of the episodes (by seed) that is held out."""
    log_every: Count = 50
    validate_every: Count = 1000
    checkpoint_every: Count = 1000


logger = logging.getLogger(__name__)


class TrainingDiverged(ValueError):
    """The loss or a weight is no longer finite."""


def fit(
    config: TrainConfig,
    run: Path,
    params: Params,
    loss: Loss,
    rows: np.ndarray,
    gather: Callable[[np.ndarray], Any],
    validate: Callable[[Params], Metrics],
    origin: Mapping[str, Any] = MappingProxyType({}),
    export: Callable[[int, Params, Metrics], None] | None = None,
) -> tuple[TrainState, Metrics]:
    """Trains from the run's newest checkpoint, or from `params`, to `config.steps`.

    Each batch is split evenly among all devices; the weights are the same as on one, up to
    rounding.

    Args:
        config: Steps, batch size, optimiser, intervals, seed.
        run: Directory for `config.json`, `metrics.jsonl` and `checkpoints/`.
        params: Initial weights.
        loss: loss(params, key, batch) -> (loss, metrics); jitted here.
        rows: Rows of the data set to train on.
        gather: Rows [batch_size] to the batch that `loss` takes.
        validate: Metrics of the averaged weights on what was held out.
        origin: Checksums of all that the weights come from, beside the settings.
        export: Called with the step, the averaged weights and their metrics at each validation.

    Returns:
        The final state and its validation metrics.

    Raises:
        TrainingDiverged: Not finite any more; the last good checkpoint is kept.
        RunError: `run` was begun with other settings or of another origin, another process
            trains there, or a batch cannot be split evenly.
    """
    devices = Devices()
    if min(config.batch_size, len(rows)) % devices.count:
        raise RunError(
            f"batch_size {config.batch_size} cannot be split among {devices.count} devices"
        )
    with claimed(run, config, origin) as store:
        tx = optimizer(config.optimizer, config.steps)
        state = devices.replicate(init_state(params, tx))
        if (last := checkpoint.latest(store)) is not None:
            state = checkpoint.restore(store, last, state)
            logger.info("resumed %s at step %d", run, last)
        first, steps, size = int(state.step), config.steps, config.batch_size
        step_fn = jax.jit(
            partial(train_step, loss, tx, config.optimizer), donate_argnums=0
        )
        key = jax.random.key(config.seed)
        measured: Metrics = {}

        def due(done: int, every: int) -> bool:
            return done % every == 0 or done == steps

        path = run / "metrics.jsonl"
        with Progress(path, config.name, first, steps, size) as progress:
            for done in range(first + 1, steps + 1):
                batch = devices.split(gather(rows_of_step(config, rows, done - 1)))
                state, metrics = step_fn(state, key, batch)
                if due(done, config.log_every):
                    values = {name: float(value) for name, value in metrics.items()}
                    _check_finite(values["loss"], done)
                    progress.trained(done, values)
                if due(done, config.validate_every):
                    measured = validate(state.ema_params)
                    progress.validated(done, measured)
                    logger.info("step %d: %s", done, _line(measured))
                    if export is not None:
                        export(done, state.ema_params, measured)
                if due(done, config.checkpoint_every):
                    _check_finite(float(metrics["loss"]), done)
                    if not _all_finite(state):
                        raise TrainingDiverged(_diverged("a weight", done))
                    checkpoint.save(store, done, state)
        return state, measured if first < steps else validate(state.ema_params)


def rows_of_step(config: TrainConfig, rows: np.ndarray, step: int) -> np.ndarray:
    """The rows of step `step`, a function of the seed and the step only.

    So a run can be resumed anywhere. Each epoch is its own permutation; its odd rest is
    left out.
    """
    size = min(config.batch_size, len(rows))
    epoch, position = divmod(step, len(rows) // size)
    order = _order(config.seed, epoch, len(rows))
    return rows[order[position * size : (position + 1) * size]]


@lru_cache(maxsize=2)
def _order(seed: int, epoch: int, rows: int) -> np.ndarray:
    """An epoch's permutation."""
    return np.random.default_rng([seed, epoch]).permutation(rows)


def held_out(seeds: np.ndarray, fraction: float) -> np.ndarray:
    """Mask of the rows whose episode is held out; the choice depends on the seed alone.

    At least one episode is held out, and where there are two, one is trained on.
    """
    unique = np.unique(seeds)
    order = np.argsort([np.random.default_rng([1, int(s)]).random() for s in unique])
    count = min(max(1, round(fraction * len(unique))), max(1, len(unique) - 1))
    return np.isin(seeds, unique[order[:count]])


def _line(metrics: Metrics) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in metrics.items())


def _check_finite(loss: float, step: int) -> None:
    if not np.isfinite(loss):
        raise TrainingDiverged(_diverged(f"the loss is {loss}", step))


def _diverged(what: str, step: int) -> str:
    return (
        f"not finite by step {step} ({what}): stopped, the last good checkpoint is kept; "
        "a lower --optimizer.learning-rate may help"
    )


@jax.jit
def _all_finite(state: TrainState) -> jax.Array:
    trees = state.params, state.ema_params, state.opt_state
    return jnp.all(jnp.array([jnp.isfinite(x).all() for x in jax.tree.leaves(trees)]))

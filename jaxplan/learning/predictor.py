"""Training the upper network: batches, loss, and what is measured on held-out episodes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import numpy as np

from jaxplan.base import Subgoal
from jaxplan.data import TOGGLES, Shard
from jaxplan.learning.augment import AugmentConfig, photometric
from jaxplan.learning.loop import TrainConfig
from jaxplan.learning.losses import LossConfig, subgoal_loss
from jaxplan.learning.run import Metrics
from jaxplan.learning.train_state import Params
from jaxplan.networks import (
    Encoder,
    Encoding,
    Predictor,
    PredictorConfig,
    as_subgoal,
    normalize,
)


@dataclass(frozen=True, kw_only=True)
class PredictorTraining(TrainConfig):
    """`python -m jaxplan.train predictor`."""

    name: str = "predictor"
    network: PredictorConfig = PredictorConfig()
    loss: LossConfig = LossConfig()
    augment: AugmentConfig = AugmentConfig()


VALIDATION_BATCH = 256


class Frames(NamedTuple):
    """A batch of observations with labels, as `Shard` has them."""

    image: jax.Array
    q: jax.Array
    gripper: jax.Array
    q_toggle: jax.Array
    gripper_toggle: jax.Array
    q_goal: jax.Array
    camera_error: jax.Array


def gather(shard: Shard, rows: np.ndarray) -> Frames:
    """Frames `rows` of `shard`."""
    return Frames(*(getattr(shard, name)[rows] for name in Frames._fields))


def init(config: PredictorConfig, key: jax.Array, frames: Frames) -> Params:
    """Fresh weights for frames of this shape."""
    inputs = frames.image[:1], frames.q[:1], frames.gripper[:1]
    return jax.jit(Predictor(config).init)(key, *inputs)


def loss(
    config: PredictorTraining, params: Params, key: jax.Array, batch: Frames
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Equation 1 with augmented images and dropout."""
    key_image, key_dropout = jax.random.split(key)
    prediction: Any = Predictor(config.network).apply(
        params,
        photometric(key_image, batch.image, config.augment),
        batch.q,
        batch.gripper,
        train=True,
        rngs={"dropout": key_dropout},
    )
    limits = config.network.q_min, config.network.q_max
    targets = Subgoal(
        normalize(batch.q_toggle, *limits),
        batch.gripper_toggle,
        normalize(batch.q_goal, *limits),
    )
    return subgoal_loss(config.loss, prediction, targets, batch.camera_error)


def validation(
    config: PredictorConfig, shard: Shard, rows: np.ndarray
) -> Callable[[Params], Metrics]:
    """Errors over frames `rows`: L2 over the joints [rad], per toggle, gripper and camera."""

    @jax.jit
    def run(params: Params, frames: Frames) -> tuple[Subgoal, jax.Array | None]:
        inputs = frames.image, frames.q, frames.gripper
        prediction: Any = Predictor(config).apply(params, *inputs)
        return as_subgoal(config, prediction), prediction.camera_error

    def validate(params: Params) -> Metrics:
        toggle, goal, gripper, camera = [], [], [], []
        for part in batches(rows, VALIDATION_BATCH):
            frames = gather(shard, part)
            subgoal, error = run(params, frames)
            if error is not None:
                camera.append(np.abs(np.asarray(error) - frames.camera_error))
            toggle.append(np.linalg.norm(subgoal.q_toggle - frames.q_toggle, axis=-1))
            goal.append(np.linalg.norm(subgoal.q_goal - frames.q_goal, axis=-1))
            gripper.append(np.asarray(subgoal.gripper_toggle) == frames.gripper_toggle)
        # `batches` fills the last batch up; what it added is cut off again.
        toggle, goal, gripper = (
            np.concatenate(part)[: len(rows)] for part in (toggle, goal, gripper)
        )
        metrics = summary(toggle, goal, gripper, shard.toggle[rows])
        if camera:
            off = np.median(np.concatenate(camera)[: len(rows)], axis=0)
            axes = "yaw", "pitch", "right", "up", "back"
            metrics |= {
                f"camera_{axis}": float(x) for axis, x in zip(axes, off, strict=True)
            }
        return metrics

    return validate


def summary(
    toggle: np.ndarray, goal: np.ndarray, gripper: np.ndarray, index: np.ndarray
) -> Metrics:
    """Medians, means and 90th percentiles [rad] of the errors [N]."""
    metrics = {
        "toggle_median": np.median(toggle),
        "toggle_mean": toggle.mean(),
        "toggle_p90": np.quantile(toggle, 0.9),
        "goal_median": np.median(goal),
        "goal_mean": goal.mean(),
        "goal_p90": np.quantile(goal, 0.9),
        "gripper_accuracy": gripper.mean(),
    }
    for i, name in enumerate(TOGGLES):
        if (of := index == i).any():
            metrics[f"toggle_median_{name}"] = np.median(toggle[of])
            metrics[f"toggle_mean_{name}"] = toggle[of].mean()
    return {name: float(value) for name, value in metrics.items()}


def batches(rows: np.ndarray, size: int) -> list[np.ndarray]:
    """`rows` in equal parts; the last is filled up with its own last row."""
    size = min(size, len(rows))
    filled = np.concatenate([rows, np.full(-len(rows) % size, rows[-1])])
    return list(filled.reshape(-1, size))


def encodings(config: PredictorConfig, params: Params, image: np.ndarray) -> Encoding:
    """What the encoder says of all images [N, 88, 136, 3], a row each."""
    network: Any = Encoder(config.encoder)
    weights = {"params": params["params"]["encoder"]}
    run = jax.jit(network.apply)
    parts = batches(np.arange(len(image)), VALIDATION_BATCH)
    said = [jax.tree.map(np.asarray, run(weights, image[part])) for part in parts]
    return jax.tree.map(lambda *each: np.concatenate(each)[: len(image)], *said)

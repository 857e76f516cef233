"""What the trainings of all policies share: windows of demonstrations, how actions are judged."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.data import DataError, TimedShard
from jaxplan.learning.augment import AugmentConfig, photometric
from jaxplan.learning.loop import TrainConfig
from jaxplan.learning.losses import huber
from jaxplan.learning.predictor import batches
from jaxplan.learning.run import Metrics
from jaxplan.learning.train_state import Loss, Params
from jaxplan.networks import (
    ERROR_SCALE,
    Chunk,
    Encoding,
    PolicyConfig,
    Window,
    decode,
    encode,
    plain,
)
from jaxplan.ranges import Count, NotNegative, Whole


@dataclass(frozen=True, kw_only=True)
class PolicyTraining(TrainConfig):
    """What the trainings of all policies have in common."""

    network: PolicyConfig
    sight: str | None = None
    """Directory of a predictor whose sight training begins with: encoder, calibration; None = a
    fresh one."""
    encode_once: bool = False
    """That encoder stays as it is, and every picture is encoded once, as it is: all the rest is
    trained many times as fast. Then go on from there (`init`) without."""
    augment: AugmentConfig = AugmentConfig()
    near_toggle: Whole = 8
    """Frames so near to a toggle, before and after it, ..."""
    toggle_weight: Count = 2
    """... are seen this often while others are seen once, lest waits and ways drown them."""
    camera_weight: NotNegative = 1.0
    """Of the camera's error in the loss, where the network says it."""
    val_windows: Count = 1024
    """Of the held-out ones, for validation."""

    def __post_init__(self) -> None:
        """Checks the fields, and that there is an encoder to encode by.

        Raises:
            ValueError: A field makes no sense.
        """
        super().__post_init__()
        if self.encode_once and self.sight is None:
            raise ValueError("encode_once: by which encoder? see sight")


Act = Callable[[Any, Params, Window, jax.Array], jax.Array]
"""`(config, params, window [B, H, ...], keys [B]) -> chunks [B, T, d + 1]`, coded."""


class Batch(NamedTuple):
    """Windows, and what the expert did from each of their observations on."""

    window: Window
    chunk: Chunk
    """[B, H, T, ...]."""
    camera_error: jax.Array
    """[B, H, 5]."""


class Windows:
    """Batches of windows, which begin and end with their episode.

    Before its start the first frame is repeated, after its end the last action. Beside an
    accelerator all frames lie in its memory: a step moves none.

    Args:
        shard: Demonstrations.
        config: How long windows and chunks are.
    """

    def __init__(self, shard: TimedShard, config: PolicyConfig) -> None:
        edge = np.flatnonzero(np.diff(shard.seed)) + 1
        first, last = np.r_[0, edge], np.r_[edge, len(shard.seed)] - 1
        length = last - first + 1
        self._first, self._last = np.repeat(first, length), np.repeat(last, length)
        self._back = np.arange(1 - config.history, 1)
        self._ahead = np.arange(config.horizon)
        names = "image", "q", "gripper", "action_q", "action_gripper", "camera_error"
        columns = [getattr(shard, name) for name in names]
        self._take = _take
        if jax.default_backend() != "cpu":
            columns, self._take = jax.device_put(columns), jax.jit(_take)
        self._columns = columns

    def __call__(self, rows: np.ndarray) -> Batch:
        """The windows that end at frames `rows` [B]."""
        seen = np.maximum(rows[:, None] + self._back, self._first[rows][:, None])
        last = self._last[rows][:, None, None]
        done = np.minimum(seen[..., None] + self._ahead, last)
        return self._take(self._columns, seen, done)


def _take(columns: list[Any], seen: Any, done: Any) -> Batch:
    image, q, gripper, action_q, action_gripper, error = columns
    return Batch(
        Window(jax.tree.map(lambda x: x[seen], image), q[seen], gripper[seen]),
        Chunk(action_q[done], action_gripper[done]),
        error[seen],
    )


def fitted(config: PolicyConfig, shard: TimedShard) -> PolicyConfig:
    """The same, for actions as these demonstrations have them."""
    if not len(shard.q):
        raise DataError("no frame of any episode that succeeded")
    batch = Windows(shard._replace(image=shard.seed), replace(config, history=1))
    rows = np.arange(len(shard.q))
    low, high = [], []
    for part in np.array_split(rows, -(-len(rows) // 4096)):
        window, chunk, _ = batch(part)
        coded = plain(config, jnp.asarray(window.q), jnp.asarray(chunk.q))
        low.append(np.asarray(coded.min((0, 1, 2))))
        high.append(np.asarray(coded.max((0, 1, 2))))
    low, high = np.min(low, 0), np.max(high, 0)
    # A joint that never moves is still a number.
    room = np.maximum(0.0, 1e-3 - (high - low))
    bounds = (low - room).tolist(), (high + room).tolist()
    return replace(config, action_low=tuple(bounds[0]), action_high=tuple(bounds[1]))


def weighted(config: PolicyTraining, shard: TimedShard, rows: np.ndarray) -> np.ndarray:
    """`rows`, those near a toggle `toggle_weight` times."""
    toggles = np.flatnonzero(shard.gripper != shard.action_gripper)
    near = np.zeros(len(shard.q), bool)
    for shift in range(-config.near_toggle, config.near_toggle + 1):
        at = toggles + shift
        at = at[(at >= 0) & (at < len(near))]
        near[at[shard.seed[at] == shard.seed[at - shift]]] = True
    return np.repeat(rows, np.where(near[rows], config.toggle_weight, 1))


def examples(
    config: PolicyTraining, key: jax.Array, batch: Batch
) -> tuple[Window, jax.Array]:
    """Windows with augmented pictures, and the coded chunks [B, H, T, d + 1] to say."""
    window = batch.window
    x_0 = encode(config.network, window.q, batch.chunk)
    if isinstance(window.image, Encoding):
        return window, x_0
    pixels = window.image.reshape(-1, *window.image.shape[-3:])
    image = photometric(key, pixels, config.augment).reshape(window.image.shape)
    return window._replace(image=image), x_0


def with_camera(
    config: PolicyTraining,
    value: jax.Array,
    error: jax.Array | None,
    batch: Batch,
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """A policy's loss, with that of the camera's error where the network says it."""
    if error is None:
        return value, {}
    off = (error - batch.camera_error) / ERROR_SCALE
    camera = jnp.mean(huber(off, 0.01))
    return value + config.camera_weight * camera, {"camera": camera}


VALIDATION_BATCH = 64


def validation(
    config: PolicyTraining,
    act: Act,
    loss: Loss,
    gather: Windows,
    rows: np.ndarray,
) -> Callable[[Params], Metrics]:
    """Loss on held-out windows, and errors of the actions that would be executed.

    Joints [rad]: the largest of the arm in the mean over the actions, and its 90th percentile;
    gripper: share of right modes, and of windows in which the gripper toggles at the right action.
    """
    network, key = config.network, jax.random.key(20_251_207)
    spread = np.linspace(0, len(rows) - 1, min(len(rows), config.val_windows))
    parts = batches(rows[spread.astype(int)], VALIDATION_BATCH)

    @jax.jit
    def run(params: Params, batch: Batch) -> tuple[jax.Array, ...]:
        value, _ = loss(params, key, batch)
        keys = jax.random.split(key, len(batch.window.q))
        q = batch.window.q[:, -1]
        said = decode(network, q, act(network, params, batch.window, keys))
        true = jax.tree.map(lambda x: x[:, -1], batch.chunk)
        n = network.executed
        off = jnp.abs(said.q - true.q)[:, :n].max(-1)
        right = said.gripper[:, :n] == true.gripper[:, :n]
        toggles = (true.gripper[:, :n] != batch.window.gripper[:, -1:]).any(1)
        return value, off, right, toggles

    def validate(params: Params) -> Metrics:
        columns = zip(*(run(params, gather(part)) for part in parts), strict=True)
        value, off, right, toggles = (np.stack(column) for column in columns)
        right, toggles = right.reshape(-1, network.executed), toggles.ravel()
        metrics = {
            "loss": value.mean(),
            "q_mean": off.mean(),
            "q_p90": np.quantile(off, 0.9),
            "gripper_accuracy": right.mean(),
        }
        if toggles.any():
            metrics["toggle_accuracy"] = right[toggles].all(1).mean()
        return {name: float(value) for name, value in metrics.items()}

    return validate

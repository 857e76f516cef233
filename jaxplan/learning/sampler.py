"""What the trainings of all learned samplers share: batches, and how drawn segments are judged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import diffusion
from jaxplan.data import Shard
from jaxplan.learning.loop import TrainConfig
from jaxplan.learning.run import Metrics
from jaxplan.learning.segments import PathRows, path_rows, training_segments
from jaxplan.learning.train_state import Loss, Params
from jaxplan.networks import AnyCond, Cond, SegmentConfig
from jaxplan.planning.segment import Segment
from jaxplan.ranges import Count, NotNegative


@dataclass(frozen=True, kw_only=True)
class SegmentTraining(TrainConfig):
    """What the trainings of all learned samplers have in common."""

    network: SegmentConfig
    predictor: str = "jaxplan/pretrained"
    """Directory with the predictor's weights; read where the sampler has no encoder."""
    target_noise: NotNegative = 0.02
    """Standard deviation of the noise on q_toggle and q_goal in the condition [rad], so that
    the sampler does not overtrust targets that a predictor will estimate."""
    val_problems: Count = 64
    val_segments: Count = 32
    """Validation draws `val_segments` segments for each of `val_problems` conditions."""


Draw = Callable[[Any, dict, AnyCond, jax.Array, int], Segment]
"""`(config, params, cond [P], keys [P], n) -> Segment [P, n]`: a sampler family's."""


class Phases(NamedTuple):
    """A batch of starts: frames of an episode, or a scene's problems."""

    cond: AnyCond
    paths: PathRows


Gather = Callable[[np.ndarray], Phases]
"""Rows of a data set to their batch."""


def gather(shard: Shard, image: np.ndarray, rows: np.ndarray) -> Phases:
    """Frames `rows`; `image` [F, ...] holds pixels or the predictor's features."""
    names = Cond._fields[1:]
    columns = [image, *(getattr(shard, name) for name in names)]
    cond = Cond(*(jnp.asarray(column[rows]) for column in columns))
    return Phases(cond, path_rows(shard, rows))


def examples(
    config: SegmentTraining, key: jax.Array, batch: Phases
) -> tuple[AnyCond, jax.Array]:
    """Conditions with noise on their targets, and a fresh true x_0 [B, size] for each."""
    key_targets, key_segments = jax.random.split(key)
    network = config.network
    cond = perturb_targets(key_targets, batch.cond, config.target_noise)
    steps = network.step_min, network.step_max
    base, segment = training_segments(key_segments, batch.paths, *steps)
    x_0 = diffusion.encode(segment.direction, segment.length, *steps)
    if network.tree_context:
        own = diffusion.encode_base(base, batch.cond.q, network.base_spread)
        x_0 = jnp.concatenate([x_0, own], axis=-1)
    return cond, x_0


def perturb_targets(key: jax.Array, cond: AnyCond, scale: float) -> AnyCond:
    """Noise of `scale` [rad] on q_toggle and q_goal, which are a network's in an episode.

    Where they are one point they stay one, as in the last phase before a toggle. A scene's
    problems say exactly where they lead.
    """
    if not isinstance(cond, Cond):
        return cond
    key_toggle, key_goal = jax.random.split(key)
    toggle = scale * jax.random.normal(key_toggle, cond.q_toggle.shape)
    goal = scale * jax.random.normal(key_goal, cond.q_goal.shape)
    same = jnp.all(cond.q_toggle == cond.q_goal, axis=-1, keepdims=True)
    return cond._replace(
        q_toggle=cond.q_toggle + toggle,
        q_goal=cond.q_goal + jnp.where(same, toggle, goal),
    )


def validation(
    config: SegmentTraining,
    draw: Draw,
    loss: Loss,
    gather: Gather,
    rows: np.ndarray,
) -> Callable[[Params], Metrics]:
    """Loss on held-out frames, and how well drawn directions match true ones [deg].

    Precision: angle of a drawn direction to the nearest true one of its phase.
    Coverage: angle of a true direction to the nearest drawn one.
    With `tree_context` also how well bases lie on the path, and directions along it.
    """
    network, n = config.network, config.val_segments
    key = jax.random.key(20_251_130)
    spread = np.linspace(0, len(rows) - 1, min(len(rows), config.val_problems))
    batch = gather(rows[spread.astype(int)])
    many = gather(rows[:: max(1, len(rows) // 1024)])

    @jax.jit
    def run(params: Params, batch: Phases, many: Phases) -> dict[str, jax.Array]:
        keys = jax.random.split(key, len(batch.paths.arc))
        drawn = draw(network, params, batch.cond, keys, n)
        true = jax.vmap(
            lambda k: training_segments(
                k, batch.paths, network.step_min, network.step_max
            )
        )(jax.random.split(jax.random.fold_in(key, 1), n))[1]
        cosine = jnp.einsum("pnj,mpj->pnm", drawn.direction, true.direction)
        angle = jnp.degrees(jnp.arccos(jnp.clip(cosine, -1.0, 1.0)))
        precision, coverage = angle.min(2), angle.min(1)
        value, parts = loss(params, key, many)
        return {
            "loss": value,
            **parts,
            "precision_median": jnp.median(precision),
            "precision_p90": jnp.quantile(precision, 0.9),
            "coverage_median": jnp.median(coverage),
            "coverage_p90": jnp.quantile(coverage, 0.9),
            "length_mean": drawn.length.mean(),
            "length_mean_true": true.length.mean(),
            **_beside_path(drawn, batch.paths),
        }

    def validate(params: Params) -> Metrics:
        return {name: float(value) for name, value in run(params, batch, many).items()}

    return validate


def _beside_path(drawn: Segment, paths: PathRows) -> dict[str, jax.Array]:
    """How far bases are from the path [rad], and directions from it there [deg]."""
    if drawn.base is None:
        return {}
    gaps = jnp.linalg.norm(drawn.base[:, :, None] - paths.q[:, None], axis=-1)
    at = jnp.minimum(jnp.argmin(gaps, axis=-1), paths.q.shape[1] - 2)
    here, next_ = (
        jnp.take_along_axis(paths.q, (at + i)[..., None], axis=1) for i in (0, 1)
    )
    tangent = (next_ - here) / jnp.linalg.norm(next_ - here, axis=-1, keepdims=True)
    cosine = jnp.clip(jnp.sum(tangent * drawn.direction, axis=-1), -1.0, 1.0)
    return {
        "base_distance_median": jnp.median(gaps.min(axis=-1)),
        "base_angle_median": jnp.median(jnp.degrees(jnp.arccos(cosine))),
    }

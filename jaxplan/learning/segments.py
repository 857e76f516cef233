"""Training segments: where on the expert's path a tree might stand, and where it goes next.

The condition of a phase does not say at which node a segment will be used, so the sampler
learns the distribution over all of the phase's nodes: the base is drawn uniformly in arc
length between the frame and the subgoal, on the executed path.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Key

from jaxplan.data import NO_PATH, Shard
from jaxplan.planning.segment import Segment


class PathRows(NamedTuple):
    """For each frame the path that it lies on, and where."""

    q: jax.Array
    """[B, N, d], points uniform in arc length, ending at q_goal [rad]."""
    length: jax.Array
    """[B], arc length of the path [rad]."""
    arc: jax.Array
    """[B], arc position of the frame [rad]."""


def eligible(shard: Shard, step_min: float) -> np.ndarray:
    """Rows of frames that lie on a path with at least `step_min` [rad] left."""
    length = np.append(shard.path_length, 0.0)[shard.path]  # NO_PATH = -1: length 0
    left = length - shard.arc
    return np.flatnonzero((shard.path != NO_PATH) & (left >= step_min))


def path_rows(shard: Shard, rows: np.ndarray) -> PathRows:
    """The paths of eligible frames `rows`."""
    path = shard.path[rows]
    columns = shard.path_q[path], shard.path_length[path], shard.arc[rows]
    return PathRows(*map(jnp.asarray, columns))


def training_segments(
    key: Key[Array, ""], paths: PathRows, step_min: float, step_max: float
) -> tuple[Float[Array, "B d"], Segment]:
    """One base [rad] and one segment of each path; base + s u lies on the path.

    s is the straight distance to the point a drawn arc further, hence at most that arc.
    """
    key_base, key_step = jax.random.split(key)
    shape = paths.arc.shape
    end = jnp.maximum(paths.arc, paths.length - step_min)
    base_arc = paths.arc + jax.random.uniform(key_base, shape) * (end - paths.arc)
    longest = jnp.minimum(step_max, paths.length - base_arc)
    step = step_min + jax.random.uniform(key_step, shape) * (longest - step_min)
    base = point_at(paths, base_arc)
    delta = point_at(paths, base_arc + step) - base
    length = jnp.linalg.norm(delta, axis=-1)
    return base, Segment(delta / jnp.maximum(length, 1e-6)[..., None], length)


def point_at(paths: PathRows, arc: Float[Array, " B"]) -> Float[Array, "B d"]:
    """Points of the paths at arc positions [rad]."""
    last = paths.q.shape[-2] - 1
    place = jnp.clip(arc / jnp.maximum(paths.length, 1e-6), 0.0, 1.0) * last
    low = jnp.minimum(place.astype(jnp.int32), last - 1)
    row = jnp.arange(len(low))
    share = (place - low)[:, None]
    return (1.0 - share) * paths.q[row, low] + share * paths.q[row, low + 1]

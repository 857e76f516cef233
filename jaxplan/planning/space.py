"""The space of configurations: limits, circles, and how far apart two of them are."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.typing import ArrayLike

ROAM = 10.0
"""How far beyond start and goal a joint without a limit is searched [m, or rad]."""
TURN = 2 * math.pi


def rounded(product: jax.Array) -> jax.Array:
    """A product that is rounded before something is added to it.

    Else one program multiplies and adds in one instruction and the next one does not, and an
    answer would depend on the size of its batch. XLA on CPU looks past barriers, and not
    through a maximum.
    """
    return jnp.maximum(product, -jnp.finfo(jnp.float32).max)


def short_way(gap: Any) -> Any:
    """Differences of angles, an array of NumPy or JAX, by the nearest whole number of turns."""
    return gap - TURN * (gap / TURN).round()


def dot(a: Float[Array, "... d"], b: Float[Array, "... d"]) -> Float[Array, "..."]:
    """Products over the last axis, summed joint by joint."""
    products = rounded(a * b)
    return sum(products[..., j] for j in range(products.shape[-1]))  # type: ignore


def norm(vectors: Float[Array, "*B d"]) -> Float[Array, "*B"]:
    """Lengths over the last axis."""
    return jnp.sqrt(dot(vectors, vectors))


@dataclasses.dataclass(frozen=True, eq=False)
class Space:
    """Where d joints can be. Static: it is read while a search is traced.

    A circular joint lives on a circle: q and q + 2 pi are the same. Nodes of a tree are
    kept as they were reached, so that a motion from one to the next goes straight.
    """

    q_min: np.ndarray
    """`[d]` lower limits [rad or m]; -inf where there is none."""
    q_max: np.ndarray
    """`[d]` upper limits [rad or m]; inf where there is none."""
    circular: tuple[bool, ...]
    """`[d]` joints without limits that come round."""
    metric: tuple[float, ...] | None = None
    """Diagonal of W in d(q, q') = |W (q - q')|; None = identity."""

    @classmethod
    def of(
        cls,
        q_min: ArrayLike,
        q_max: ArrayLike,
        circular: ArrayLike | None = None,
        metric: tuple[float, ...] | None = None,
    ) -> "Space":
        """A space from arrays `[d]`; circular joints have no limits.

        Raises:
            ValueError: Arrays of the wrong shape, or q_min not below q_max.
        """
        low, high = np.asarray(q_min, np.float32), np.asarray(q_max, np.float32)
        if low.ndim != 1 or low.shape != high.shape or not np.all(low < high):
            raise ValueError(f"joint limits need q_min < q_max: {low} {high}")
        round_ = np.zeros(low.shape, bool) if circular is None else np.array(circular)
        if round_.shape != low.shape:
            raise ValueError(f"circular has shape {round_.shape}, expected {low.shape}")
        low, high = np.where(round_, -np.inf, low), np.where(round_, np.inf, high)
        return cls(
            low.astype(np.float32),
            high.astype(np.float32),
            tuple(map(bool, round_)),
            metric,
        )

    @property
    def turns(self) -> bool:
        """Whether any joint comes round."""
        return any(self.circular)

    def short(self, gap: jax.Array, joint: int) -> jax.Array:
        """Differences of one joint, the short way round if it is circular."""
        if not self.circular[joint]:
            return gap
        return short_way(gap)

    def gap(self, q0: jax.Array, q1: jax.Array) -> jax.Array:
        """`[..., d]` the shortest way from q0 to q1."""
        gap = q1 - q0
        if not self.turns:
            return gap
        short = gap - rounded(TURN * jnp.round(gap / TURN))
        return jnp.where(np.array(self.circular), short, gap)

    def distance(self, q0: jax.Array, q1: jax.Array) -> jax.Array:
        """d(q, q') over the last axis."""
        gap = self.gap(q1, q0)
        return jnp.sqrt(self.squares([gap[..., j] for j in range(gap.shape[-1])]))

    def squares(self, gaps: list[jax.Array]) -> jax.Array:
        """Squared distances of differences that are given joint by joint.

        Joint by joint, since XLA CPU does not vectorise over so short an axis.
        """
        weights = (1.0,) * len(gaps) if self.metric is None else self.metric
        return sum(
            (gap if w == 1.0 else w * gap) ** 2
            for w, gap in zip(weights, gaps, strict=True)
        )  # type: ignore[return-value]

    def project(self, q: jax.Array) -> jax.Array:
        """q within the limits."""
        return jnp.clip(q, self.q_min, self.q_max)

    def box(self, q_start: jax.Array, q_goal: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Corners `[..., d]` of what is sampled for problems `[..., d]`.

        A circle once around; a joint that nothing limits as far as `ROAM` beyond start and
        goal.
        """
        low, high = jnp.asarray(self.q_min), jnp.asarray(self.q_max)
        if np.isfinite([self.q_min, self.q_max]).all():
            return low, high
        near = jnp.minimum(q_start, q_goal) - ROAM
        far = jnp.maximum(q_start, q_goal) + ROAM
        low = jnp.where(np.isfinite(self.q_min), low, near)
        high = jnp.where(np.isfinite(self.q_max), high, far)
        circular = np.array(self.circular)
        low, high = (
            jnp.where(circular, x, y) for x, y in ((-math.pi, low), (math.pi, high))
        )
        return low, high

    def unwound(self, path: jax.Array) -> jax.Array:
        """`[..., W, d]` the same path, each waypoint the short way from the one before."""
        if not self.turns:
            return path
        steps = self.gap(path[..., :-1, :], path[..., 1:, :])
        ways = jnp.cumsum(jnp.concatenate([path[..., :1, :], steps], -2), -2)
        return jnp.where(np.array(self.circular), ways, path)

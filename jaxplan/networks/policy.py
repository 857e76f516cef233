"""What all policies have in common: what they see, and how the actions that they say are coded.

A chunk of actions is coded in [-1, 1] by the demonstrations' own range. Relative to where the arm
is, an action k steps ahead is divided by k: it is the mean velocity on the way there, so that the
first steps, which are executed, are said as precisely as the last ones.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.joints import normalize, unnormalize
from jaxplan.networks.sight import LAYERS, SightConfig, see
from jaxplan.ranges import Count, Number


@dataclass(frozen=True)
class PolicyConfig(SightConfig):
    """What a policy sees and says (section 5.3)."""

    history: Count = 2
    """H, the observations that it sees: the present one last, the first of an episode repeated
    before its start."""
    horizon: Count = 16
    """T, the actions that it says."""
    executed: Count = 8
    """After so many of them it is asked again."""
    relative: bool = True
    """Says joints relative to where they are; absolute ones where False."""
    action_low: tuple[Number, ...] = ()
    """Least and greatest value of each joint's actions: [rad] a step, or [rad] where absolute. Read
    off the demonstrations when training begins."""
    action_high: tuple[Number, ...] = ()

    @property
    def size(self) -> int:
        """Numbers of an action: joints, and the gripper last."""
        return len(self.q_min) + 1


class Window(NamedTuple):
    """The last H observations."""

    image: Any
    """u8 [..., H, 88, 136, 3]; in training maybe what an encoder has said of it."""
    q: Any
    """[..., H, d] [rad]."""
    gripper: Any
    """[..., H], 0 open, 1 closed."""


class Chunk(NamedTuple):
    """The next T actions."""

    q: Any
    """[..., T, d] where the arm is to be a period later each [rad]."""
    gripper: Any
    """[..., T] the gripper's mode then: 0 open, 1 closed."""


def plain(config: PolicyConfig, q: jax.Array, chunk_q: jax.Array) -> jax.Array:
    """Joints of a chunk `[..., T, d]` as they are coded, before scaling.

    Args:
        config: Absolute or relative.
        q: Where the arm is, `[..., d]` [rad].
        chunk_q: `[..., T, d]` [rad].
    """
    if not config.relative:
        return chunk_q
    return (chunk_q - q[..., None, :]) / _steps(chunk_q.shape[-2])


def encode(config: PolicyConfig, q: jax.Array, chunk: Chunk) -> jax.Array:
    """A chunk in [-1, 1], `[..., T, d + 1]`, of an arm at `q` [..., d] [rad]."""
    scaled = normalize(plain(config, q, chunk.q), config.action_low, config.action_high)
    mode = 2.0 * chunk.gripper[..., None].astype(jnp.float32) - 1.0
    return jnp.concatenate([scaled, mode], axis=-1)


def decode(config: PolicyConfig, q: jax.Array, x: jax.Array) -> Chunk:
    """The chunk in `x` [..., T, d + 1]."""
    joints = unnormalize(x[..., :-1], config.action_low, config.action_high)
    if config.relative:
        joints = q[..., None, :] + joints * _steps(x.shape[-2])
    return Chunk(joints, (x[..., -1] > 0).astype(jnp.int32))


WINDOW = "window"
"""What the encoder of its window is called in every policy."""


class WindowEncoder(nn.Module):
    """Each observation of a window as a vector, and what it says of the camera."""

    config: PolicyConfig
    features: int

    @nn.compact
    def __call__(self, window: Window) -> tuple[jax.Array, jax.Array | None]:
        """`[..., H, features]`, and `[..., H, 5]` where the network calibrates."""
        sight = see(self.config, *window)
        return nn.Dense(self.features)(sight.inputs), sight.camera_error


def with_sight(params: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """A policy's weights, with the sight of another network that sees (`LAYERS`).

    Raises:
        KeyError: Theirs has other sizes.
    """
    mine, theirs = params["params"][WINDOW], other["params"]
    taken = {name: theirs[name] for name in LAYERS if name in theirs}
    for name in LAYERS:
        shapes = [jax.tree.map(jnp.shape, side.get(name)) for side in (mine, taken)]
        if shapes[0] != shapes[1]:
            raise KeyError(name)
    return {"params": params["params"] | {WINDOW: mine | taken}}


def _steps(horizon: int) -> jax.Array:
    return jnp.arange(1, horizon + 1, dtype=jnp.float32)[:, None]

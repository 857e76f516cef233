"""The image encoder: a ResNet with group normalisation, read out by a spatial softmax.

Padding, initialisation and epsilon follow torchvision's ResNet, so that `last_strides`
(2, 2), width 64 and blocks (2, 2, 2, 2) is the ResNet-18 of Diffusion Policy's encoder.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.ranges import Checked, Count


@dataclass(frozen=True)
class EncoderConfig(Checked):
    """Image encoder. The defaults are ResNet-18 with group normalisation (section 4.3)."""

    stem: Literal["conv7", "patch4"] = "conv7"
    """`conv7`: 7x7 stride 2 and max-pool. `patch4`: 4x4 pixels to channels and a 3x3; both
    quarter the resolution."""
    width: Count = 64
    """Channels of the first stage; each later stage doubles them."""
    blocks: tuple[Count, ...] = (2, 2, 2, 2)
    """Residual blocks of each stage."""
    last_strides: tuple[Count, Count] = (2, 2)
    """Strides of the last two stages; 1 keeps spatial cells and with them precision."""
    keypoints: Count = 32
    """Maps of the spatial softmax."""
    features: Count = 64
    average: bool = False
    """Adds a projection of the global average: whether and how big, beside where."""
    scales: Count = 1
    """Stages whose maps are summed before the spatial softmax, at the finest one's resolution."""


_conv = partial(
    nn.Conv,
    use_bias=False,
    kernel_init=nn.initializers.variance_scaling(2.0, "fan_out", "normal"),
)


def group_norm(channels: int, name: str | None = None) -> nn.GroupNorm:
    """Group normalisation with 16 channels a group, at least one group."""
    return nn.GroupNorm(max(1, channels // 16), epsilon=1e-5, name=name)


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions and a shortcut."""

    channels: int
    stride: int = 1

    @nn.compact
    def __call__(self, x: jax.Array) -> jax.Array:
        pad = ((1, 1), (1, 1))
        strides = (self.stride, self.stride)
        h = _conv(self.channels, (3, 3), strides, padding=pad)(x)
        h = nn.relu(group_norm(self.channels)(h))
        h = _conv(self.channels, (3, 3), padding=pad)(h)
        h = group_norm(self.channels)(h)
        if x.shape[-1] != self.channels or self.stride != 1:
            x = _conv(self.channels, (1, 1), strides, padding="VALID")(x)
            x = group_norm(self.channels)(x)
        return nn.relu(h + x)


class Encoding(NamedTuple):
    """What an image says."""

    features: jax.Array
    """[..., F]."""
    keypoints: jax.Array
    """[..., K, 2], x and y in [-1, 1]."""


class Encoder(nn.Module):
    """Image u8 [..., H, W, 3] to features and the keypoints behind them."""

    config: EncoderConfig

    @nn.compact
    def __call__(self, image: jax.Array) -> Encoding:
        config = self.config
        batch = image.shape[:-3]
        x = image.reshape(-1, *image.shape[-3:])
        x = _stem(config, x.astype(jnp.float32) / 127.5 - 1.0)
        stages = []
        for stage, blocks in enumerate(config.blocks):
            tail = len(config.blocks) - stage
            stride = 1 if stage == 0 else 2
            if tail <= 2 and stage > 0:
                stride = config.last_strides[-tail]
            for block in range(blocks):
                width = config.width * 2**stage
                x = ResidualBlock(width, stride if block == 0 else 1)(x)
            stages.append(x)
        maps = nn.Conv(config.keypoints, (1, 1), name="keypoints")(x)
        for coarser, finer in enumerate(stages[-config.scales : -1][::-1], 1):
            name = f"keypoints_{coarser}"
            finer = nn.Conv(config.keypoints, (1, 1), use_bias=False, name=name)(finer)
            maps = finer + _enlarged(maps, finer.shape)
        keypoints = spatial_softmax(maps)
        features = nn.Dense(config.features)(keypoints)
        if config.average:
            average = nn.Dense(config.features)(x.mean((1, 2)))
            features = jnp.concatenate([features, average], axis=-1)
        return Encoding(
            features.reshape(*batch, -1),
            keypoints.reshape(*batch, config.keypoints, 2),
        )


def _enlarged(maps: jax.Array, shape: tuple[int, ...]) -> jax.Array:
    """Maps of the next finer stage's `shape`, each cell repeated."""
    for axis in (1, 2):
        if maps.shape[axis] < shape[axis]:
            maps = jnp.repeat(maps, 2, axis=axis)
    return maps[:, : shape[1], : shape[2]]


def spatial_softmax(maps: jax.Array) -> jax.Array:
    """Expected position of each map's softmax, `[B, H, W, K]` to `[B, 2 K]`.

    x and y lie in [-1, 1] with the corners of the map at -1 and 1; temperature 1.
    """
    batch, height, width, count = maps.shape
    weights = nn.softmax(maps.reshape(batch, height * width, count), axis=1)
    y, x = jnp.meshgrid(
        jnp.linspace(-1.0, 1.0, height), jnp.linspace(-1.0, 1.0, width), indexing="ij"
    )
    grid = jnp.stack([x.ravel(), y.ravel()])
    # Ten bits, a GPU's default, would be coarser than what the keypoints are read to.
    points = jnp.einsum("bpk,cp->bkc", weights, grid, precision="highest")
    return points.reshape(batch, 2 * count)


def _stem(config: EncoderConfig, x: jax.Array) -> jax.Array:
    """Quarter resolution. `patch4` spends a tenth of `conv7`'s time on a CPU."""
    if config.stem == "conv7":
        x = _conv(config.width, (7, 7), (2, 2), padding=((3, 3), (3, 3)))(x)
        x = nn.relu(group_norm(config.width)(x))
        # Padded with -inf by `max_pool` itself.
        pad: Any = ((1, 1), (1, 1))
        return nn.max_pool(x, (3, 3), (2, 2), padding=pad)
    batch, height, width, channels = x.shape
    x = x.reshape(batch, height // 4, 4, width // 4, 4, channels)
    x = x.transpose(0, 1, 3, 2, 4, 5).reshape(batch, height // 4, width // 4, -1)
    x = _conv(config.width, (3, 3), padding=((1, 1), (1, 1)))(x)
    return nn.relu(group_norm(config.width)(x))

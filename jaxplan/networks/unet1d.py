"""ConditionalUnet1D: over the d + 1 numbers of a segment (section 4.3), or over a policy's actions.

The convolutions are written as shifted copies and one matmul: the same numbers as a
convolution, several times faster on a CPU at length 8 or 16.
"""

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.mish import mish


class ConditionalUnet1D(nn.Module):
    """Diffusion Policy's U-Net; its length must divide by 2^(levels - 1).

    The FiLM vectors come in ready, so that they can be shared by all samples of a cond.
    """

    hidden: tuple[int, ...]
    kernel: int = 3

    @property
    def film_sizes(self) -> tuple[int, ...]:
        """Length of each residual block's FiLM vector (scale and shift)."""
        down = [width for width in self.hidden for _ in range(2)]
        middle = [self.hidden[-1]] * 2
        up = [width for width in self.hidden[-2::-1] for _ in range(2)]
        return tuple(2 * width for width in [*down, *middle, *up])

    @nn.compact
    def __call__(self, x: jax.Array, films: list[jax.Array]) -> jax.Array:
        """`x` [..., length, channels], `films[i]` broadcastable to [..., film_sizes[i]]."""
        queue = iter(films)

        def block(h: jax.Array, width: int) -> jax.Array:
            return FilmBlock(width, self.kernel)(h, next(queue))

        h, skips = x, []
        for level, width in enumerate(self.hidden):
            h = block(block(h, width), width)
            skips.append(h)
            if level + 1 < len(self.hidden):
                h = Conv1d(width, 3, stride=2)(h)
        h = block(block(h, self.hidden[-1]), self.hidden[-1])
        for width in self.hidden[-2::-1]:
            # As in Diffusion Policy, the top level's skip is not consumed.
            h = jnp.concatenate([h, skips.pop()], axis=-1)
            h = ConvTranspose1d(width)(block(block(h, width), width))
        h = ConvBlock(self.hidden[0], self.kernel)(h)
        return nn.Dense(x.shape[-1])(h)


class FilmBlock(nn.Module):
    """Convolution, FiLM, convolution, shortcut. `h` [..., length, channels]."""

    channels: int
    kernel: int

    @nn.compact
    def __call__(self, h: jax.Array, film: jax.Array) -> jax.Array:
        scale, shift = jnp.split(film[..., None, :], 2, axis=-1)
        r = ConvBlock(self.channels, self.kernel)(h)
        r = ConvBlock(self.channels, self.kernel)(scale * r + shift)
        return r + (h if h.shape[-1] == self.channels else nn.Dense(self.channels)(h))


class ConvBlock(nn.Module):
    """Convolution, group normalisation with 8 groups, Mish."""

    channels: int
    kernel: int

    @nn.compact
    def __call__(self, h: jax.Array) -> jax.Array:
        h = Conv1d(self.channels, self.kernel)(h)
        batch = h.shape[:-2]
        norm = nn.GroupNorm(8, epsilon=1e-5)
        return mish(norm(h.reshape(-1, *h.shape[-2:]))).reshape(*batch, *h.shape[-2:])


class Conv1d(nn.Module):
    """Convolution along the second-last axis, zero padding kernel // 2."""

    channels: int
    kernel: int
    stride: int = 1

    @nn.compact
    def __call__(self, h: jax.Array) -> jax.Array:
        return nn.Dense(self.channels)(windows(h, self.kernel)[..., :: self.stride, :])


class ConvTranspose1d(nn.Module):
    """Doubles the length: torch's ConvTranspose1d(kernel 4, stride 2, padding 1).

    Even outputs see inputs m - 1 and m, odd ones m and m + 1; each has its two taps.
    """

    channels: int

    @nn.compact
    def __call__(self, h: jax.Array) -> jax.Array:
        three = windows(h, 3)
        width = h.shape[-1]
        even = nn.Dense(self.channels, name="even")(three[..., : 2 * width])
        odd = nn.Dense(self.channels, name="odd")(three[..., width:])
        both = jnp.stack([even, odd], axis=-2)
        return both.reshape(*h.shape[:-2], 2 * h.shape[-2], self.channels)


def windows(h: jax.Array, kernel: int) -> jax.Array:
    """Zero-padded neighbourhoods, `[..., L, C]` to `[..., L, kernel * C]`."""
    half, length = kernel // 2, h.shape[-2]
    padded = jnp.pad(h, [(0, 0)] * (h.ndim - 2) + [(half, half), (0, 0)])
    shifts = [padded[..., i : i + length, :] for i in range(kernel)]
    return jnp.concatenate(shifts, axis=-1)

"""FiLM-MLP denoiser: the length-1 reading of the paper's U-Net, without dead weights."""

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.mish import mish


class FilmMlp(nn.Module):
    """Residual MLP blocks, each modulated by (1 + scale) and a shift.

    The FiLM vectors come in ready, so that they can be shared by all samples of a cond.
    """

    hidden: tuple[int, ...]
    outputs: int

    @property
    def film_sizes(self) -> tuple[int, ...]:
        """Length of each block's FiLM vector (scale and shift)."""
        return tuple(2 * width for width in self.hidden)

    @nn.compact
    def __call__(self, x: jax.Array, films: list[jax.Array]) -> jax.Array:
        """`x` [..., outputs], `films[i]` broadcastable to [..., film_sizes[i]]."""
        h = nn.Dense(self.hidden[0])(x)
        for width, film in zip(self.hidden, films, strict=True):
            scale, shift = jnp.split(film, 2, axis=-1)
            r = nn.Dense(width)(nn.LayerNorm()(h))
            r = mish((1.0 + scale) * r + shift)
            h = (h if h.shape[-1] == width else nn.Dense(width)(h)) + nn.Dense(width)(r)
        h = mish(nn.LayerNorm()(h))
        return nn.Dense(self.outputs, kernel_init=nn.initializers.zeros)(h)

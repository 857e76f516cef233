"""Photometric augmentation of a batch of images."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jaxplan.ranges import Checked, NotNegative


@dataclass(frozen=True)
class AugmentConfig(Checked):
    """Photometric augmentation, and no other.

    With a camera on the hand, shifting the image would move the object and leave the label
    behind.
    """

    brightness: NotNegative = 0.08
    """Largest shift, as a share of the range."""
    contrast: NotNegative = 0.15
    """Largest relative change."""
    noise: NotNegative = 0.01
    """Standard deviation of pixel noise, as a share of the range."""


def photometric(key: jax.Array, image: jax.Array, config: AugmentConfig) -> jax.Array:
    """u8 [B, H, W, 3] with its own brightness, contrast and noise each, u8."""
    key_brightness, key_contrast, key_noise = jax.random.split(key, 3)
    one = (len(image), 1, 1, 1)
    contrast = 1.0 + config.contrast * jax.random.uniform(
        key_contrast, one, minval=-1.0
    )
    shift = 255.0 * config.brightness
    shift = shift * jax.random.uniform(key_brightness, one, minval=-1.0)
    # Uniform noise from raw bytes: a normal draw per pixel would cost as much as the net.
    raw = jax.random.bits(key_noise, image.shape, jnp.uint8).astype(jnp.float32)
    noise = (raw - 127.5) * (2.0 * 3.0**0.5 * config.noise)
    x = (image.astype(jnp.float32) - 127.5) * contrast + 127.5 + shift + noise
    return jnp.clip(jnp.round(x), 0.0, 255.0).astype(jnp.uint8)

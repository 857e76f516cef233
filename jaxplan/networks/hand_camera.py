"""Where the hand's camera is, from the joints alone, and where a pixel's ray meets the table.

A camera on the hand sees a resting object at another place of the image from every
configuration. The joints are known, so the network need not learn the arm's kinematics to tell
where on the table a keypoint lies.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.ranges import Checked, Number, Positive
from jaxplan.robots import ROBOTS
from jaxplan.robots.panda.mount import MOUNT


@dataclass(frozen=True)
class HandCameraConfig(Checked):
    """How the hand's camera is mounted, and what plane its rays are cut with."""

    robot: str = "panda"
    """Whose hand it is (`robots.ROBOTS`)."""
    position: tuple[Number, Number, Number] = MOUNT.position
    """In the hand's frame [m]."""
    tilt: Number = MOUNT.tilt
    """About the hand's y, from straight ahead [rad]."""
    fovy: Positive = MOUNT.fovy
    """Vertical field of view [deg]."""
    aspect: Positive = MOUNT.width / MOUNT.height
    plane: Number = 0.04
    """Height above the table: the axis of what lies there [m]."""
    centre: tuple[Number, Number] = (0.47, 0.0)
    """Middle of what is looked at [m]."""
    scale: Positive = 0.15
    """Half of its extent [m]."""


ERROR_SCALE = jnp.array([0.2, 0.2, 0.02, 0.02, 0.02])
"""In which a camera's error is said and judged [rad, m]."""

exact = jax.default_matmul_precision("highest")
"""The default of GPUs, ten bits, would move what is seen by millimetres."""


@exact
def camera_pose(
    config: HandCameraConfig, q: jax.Array, error: jax.Array | None = None
) -> tuple[jax.Array, jax.Array]:
    """Where the camera is.

    Args:
        config: Mount and lens.
        q: [..., d] [rad].
        error: [..., 5] how it is off its mount: yaw, pitch [rad], then right, up, back [m].

    Returns:
        Position [..., 3] [m] and axes (columns right, up, back) [..., 3, 3].
    """
    chain = ROBOTS[config.robot].chain
    rotation = jnp.broadcast_to(jnp.eye(3), (*q.shape[:-1], 3, 3))
    position = jnp.zeros((*q.shape[:-1], 3))
    for joint, (a, d, alpha) in enumerate(chain.links):
        twist = _about_x(alpha)
        position = position + rotation @ (jnp.array([a, 0.0, 0.0]) + d * twist[:, 2])
        rotation = rotation @ twist @ _about_z(q[..., joint])
    hand = rotation @ _about_z(jnp.array(chain.turn))
    offset = jnp.array(config.position) + jnp.array([0.0, 0.0, chain.flange])
    # The turn is about z, so the flange's offset may be taken in the hand's frame.
    position, axes = position + hand @ offset, hand @ _mount(config.tilt)
    if error is None:
        return position, axes
    turn = _about_y(error[..., 0]) @ _about_x(error[..., 1])
    shift = jnp.squeeze(axes @ error[..., 2:, None], -1)
    return position + shift, axes @ turn


@exact
def on_plane(
    config: HandCameraConfig,
    image: jax.Array,
    q: jax.Array,
    error: jax.Array | None = None,
) -> jax.Array:
    """Where rays through image points meet the plane `config.plane` above the table.

    Args:
        config: Mount and lens.
        image: [..., K, 2], x to the right and y down, both in [-1, 1].
        q: [..., d] [rad].
        error: [..., 5] as for `camera_pose`.

    Returns:
        [..., K, 2], x and y in the world, about `config.centre` in units of `config.scale`,
        inside [-3, 3]: a ray near the horizon ends there.
    """
    position, axes = camera_pose(config, q, error)
    x, y = jnp.split(image, 2, axis=-1)
    half = np.tan(np.radians(config.fovy) / 2)
    rays = jnp.concatenate([x * half * config.aspect, -y * half, -jnp.ones_like(x)], -1)
    rays = rays @ jnp.swapaxes(axes, -1, -2)
    height = position[..., None, 2:] - config.plane
    distance = height / jnp.maximum(-rays[..., 2:], 0.05)
    points = position[..., None, :2] + distance * rays[..., :2]
    return jnp.clip((points - jnp.array(config.centre)) / config.scale, -3.0, 3.0)


def _mount(tilt: float) -> np.ndarray:
    """The camera's axes in the hand's frame: it looks along z, turned by `tilt` about y."""
    back = np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    right = np.array([0.0, -1.0, 0.0])
    return np.stack([right, np.cross(back, right), back], 1)


Angle = float | jax.Array
"""A constant in double precision, or what is computed; one matrix, or [...] of them."""


def _about_x(angle: Angle) -> Any:
    """[...] to [..., 3, 3]."""
    xp, c, s, zero, one = _parts(angle)
    return _matrix(xp, [one, zero, zero, zero, c, -s, zero, s, c])


def _about_y(angle: Angle) -> Any:
    xp, c, s, zero, one = _parts(angle)
    return _matrix(xp, [c, zero, s, zero, one, zero, -s, zero, c])


def _about_z(angle: Angle) -> Any:
    xp, c, s, zero, one = _parts(angle)
    return _matrix(xp, [c, -s, zero, s, c, zero, zero, zero, one])


def _parts(angle: Angle) -> tuple[Any, ...]:
    """NumPy or JAX, cosine, sine, 0 and 1."""
    xp: Any = jnp if isinstance(angle, jax.Array) else np
    return xp, xp.cos(angle), xp.sin(angle), xp.zeros_like(angle), xp.ones_like(angle)


def _matrix(xp: Any, rows: list[Any]) -> Any:
    return xp.stack(rows, -1).reshape(*rows[0].shape, 3, 3)

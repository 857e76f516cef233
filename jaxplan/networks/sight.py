"""What a network is shown, as one vector: picture, joints, gripper, and what the joints say of it.

The same for the upper network and for policies, so that none sees more than another.
"""

from dataclasses import dataclass
from typing import NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.networks.hand_camera import (
    ERROR_SCALE,
    HandCameraConfig,
    camera_pose,
    on_plane,
)
from jaxplan.networks.joints import normalize
from jaxplan.networks.resnet import Encoder, EncoderConfig, Encoding
from jaxplan.ranges import Checked, Count, Number
from jaxplan.robots.panda.limits import Q_MAX, Q_MIN


@dataclass(frozen=True)
class SightConfig(Checked):
    """What a network makes of an observation."""

    encoder: EncoderConfig = EncoderConfig()
    camera: HandCameraConfig | None = None
    """Adds where on the table the keypoints lie, by way of the joints; None = as in the paper."""
    calibrates: bool = False
    """A head of its own says how the camera is off its mount, and rays are cut with the corrected
    pose; needs `camera`."""
    state_features: Count = 64
    hidden: Count = 256
    q_min: tuple[Number, ...] = Q_MIN
    q_max: tuple[Number, ...] = Q_MAX

    def __post_init__(self) -> None:
        """Checks the fields, and that there is a camera to calibrate.

        Raises:
            ValueError: A field makes no sense.
        """
        super().__post_init__()
        if self.calibrates and self.camera is None:
            raise ValueError(
                "calibrates: there is no camera to calibrate (camera is None)"
            )


class Sight(NamedTuple):
    """What is seen."""

    inputs: jax.Array
    """[..., N], all of it."""
    features: jax.Array
    """[..., F], the encoder's image features."""
    camera_error: jax.Array | None
    """[..., 5] how the camera is off its mount: yaw, pitch [rad], then right, up, back [m]."""


LAYERS = (
    "encoder",
    "Dense_0",
    "Dense_1",
    "LayerNorm_0",
    "camera_hidden0",
    "camera_hidden1",
    "camera_error",
)
"""What `see` adds to a module, whichever it is."""


def see(
    config: SightConfig,
    image: jax.Array | Encoding,
    q: jax.Array,
    gripper: jax.Array,
) -> Sight:
    """Layers of the module in whose compact method it is called.

    Args:
        config: What to make of it.
        image: u8 [..., 88, 136, 3]; or what the encoder has said of it.
        q: [..., d] [rad].
        gripper: [...], 0 or 1.
    """
    if not isinstance(image, Encoding):
        image = Encoder(config.encoder, name="encoder")(image)
    features, keypoints = image
    state = state_vector(q, gripper, config.q_min, config.q_max)
    for _ in range(2):
        state = nn.relu(nn.Dense(config.state_features)(state))
    inputs, error = [nn.LayerNorm()(features), state], None

    def flat(*columns: jax.Array) -> list[jax.Array]:
        return [x.reshape(*q.shape[:-1], -1) for x in columns]

    if config.camera is not None:
        if config.calibrates:
            # The hand's fingers show it in the image, what stands in the room on the table.
            seen = flat(keypoints, on_plane(config.camera, keypoints, q))
            error = _camera_error(config, jnp.concatenate([*inputs, *seen], axis=-1))
        points = on_plane(config.camera, keypoints, q, error)
        inputs += flat(points, *camera_pose(config.camera, q, error))
    return Sight(jnp.concatenate(inputs, axis=-1), features, error)


def _camera_error(config: SightConfig, h: jax.Array) -> jax.Array:
    """`[..., N]` to `[..., 5]`; begins with the camera as it is mounted."""
    for k in range(2):
        h = nn.relu(nn.Dense(config.hidden, name=f"camera_hidden{k}")(h))
    still = nn.initializers.zeros_init()
    return ERROR_SCALE * nn.Dense(5, kernel_init=still, name="camera_error")(h)


def state_vector(
    q: jax.Array, gripper: jax.Array, q_min: tuple, q_max: tuple
) -> jax.Array:
    """Joints and gripper mode in [-1, 1], `[..., 8]`."""
    mode = 2.0 * gripper[..., None].astype(jnp.float32) - 1.0
    return jnp.concatenate([normalize(q, q_min, q_max), mode], axis=-1)

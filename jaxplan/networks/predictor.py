"""The upper network F_psi: where the gripper toggles next, and the subgoal on the way."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.base import Subgoal
from jaxplan.networks.hand_camera import (
    ERROR_SCALE,
    HandCameraConfig,
    camera_pose,
    on_plane,
)
from jaxplan.networks.joints import normalize, unnormalize
from jaxplan.networks.resnet import Encoder, EncoderConfig
from jaxplan.ranges import Checked, Count, Number, Probability
from jaxplan.robots.panda.limits import Q_MAX, Q_MIN


@dataclass(frozen=True)
class PredictorConfig(Checked):
    """The upper network F_psi (section 4.2)."""

    encoder: EncoderConfig = EncoderConfig()
    camera: HandCameraConfig | None = None
    """Adds where on the table the keypoints lie, by way of the joints; None = as in the paper."""
    calibrates: bool = False
    """A head of its own says how the camera is off its mount, and rays are cut with the corrected
    pose; needs `camera`."""
    state_features: Count = 64
    hidden: Count = 256
    dropout: Probability = 0.1
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


class Prediction(NamedTuple):
    """What the three heads say; joints in [-1, 1], where the losses are taken."""

    q_toggle: jax.Array
    """[..., d]."""
    gripper_logit: jax.Array
    """[...], of the gripper being closed after the toggle."""
    q_goal: jax.Array
    """[..., d]."""
    features: jax.Array
    """[..., F], the encoder's image features."""
    camera_error: jax.Array | None = None
    """[..., 5] how the camera is off its mount: yaw, pitch [rad], then right, up, back [m]."""


class Predictor(nn.Module):
    """ResNet, state MLP, fusion, three heads (section 4.2)."""

    config: PredictorConfig

    @nn.compact
    def __call__(
        self, image: jax.Array, q: jax.Array, gripper: jax.Array, train: bool = False
    ) -> Prediction:
        """`image` u8 [..., 88, 136, 3], `q` [..., d] [rad], `gripper` [...] 0 or 1."""
        config = self.config
        features, keypoints = Encoder(config.encoder, name="encoder")(image)
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
                error = self._camera_error(jnp.concatenate([*inputs, *seen], axis=-1))
            points = on_plane(config.camera, keypoints, q, error)
            inputs += flat(points, *camera_pose(config.camera, q, error))
        shared = jnp.concatenate(inputs, axis=-1)
        for _ in range(2):
            shared = nn.relu(nn.Dense(config.hidden)(shared))

        def head(outputs: int, name: str) -> jax.Array:
            h = nn.LayerNorm(name=f"{name}_norm")(shared)
            h = nn.Dropout(config.dropout, deterministic=not train)(h)
            h = nn.relu(nn.Dense(config.hidden, name=f"{name}_hidden")(h))
            return nn.Dense(outputs, name=name)(h)

        joints = len(config.q_min)
        return Prediction(
            q_toggle=head(joints, "q_toggle"),
            gripper_logit=head(1, "gripper_toggle")[..., 0],
            q_goal=head(joints, "q_goal"),
            features=features,
            camera_error=error,
        )

    def _camera_error(self, h: jax.Array) -> jax.Array:
        """`[..., N]` to `[..., 5]`; begins with the camera as it is mounted."""
        for k in range(2):
            h = nn.relu(nn.Dense(self.config.hidden, name=f"camera_hidden{k}")(h))
        still = nn.initializers.zeros_init()
        return ERROR_SCALE * nn.Dense(5, kernel_init=still, name="camera_error")(h)


def state_vector(
    q: jax.Array, gripper: jax.Array, q_min: tuple, q_max: tuple
) -> jax.Array:
    """Joints and gripper mode in [-1, 1], `[..., 8]`."""
    mode = 2.0 * gripper[..., None].astype(jnp.float32) - 1.0
    return jnp.concatenate([normalize(q, q_min, q_max), mode], axis=-1)


def as_subgoal(config: PredictorConfig, prediction: Prediction) -> Subgoal:
    """The heads in radians, inside the joint limits."""
    low, high = jnp.array(config.q_min), jnp.array(config.q_max)

    def radians(x: jax.Array) -> jax.Array:
        return jnp.clip(unnormalize(x, config.q_min, config.q_max), low, high)

    return Subgoal(
        q_toggle=radians(prediction.q_toggle),
        gripper_toggle=(prediction.gripper_logit > 0).astype(jnp.int32),
        q_goal=radians(prediction.q_goal),
    )


def predict(
    config: PredictorConfig,
    params: dict,
    image: jax.Array,
    q: jax.Array,
    gripper: jax.Array,
) -> tuple[Subgoal, jax.Array]:
    """Subgoals of a batch of observations, and their image features [B, F].

    Un-jitted: the caller jits it, with `config` static.
    """
    prediction: Any = Predictor(config).apply(params, image, q, gripper)
    return as_subgoal(config, prediction), prediction.features

"""The upper network F_psi: where the gripper toggles next, and the subgoal on the way."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan.base import Subgoal
from jaxplan.networks.joints import unnormalize
from jaxplan.networks.sight import SightConfig, see
from jaxplan.ranges import Probability


@dataclass(frozen=True)
class PredictorConfig(SightConfig):
    """The upper network F_psi (section 4.2)."""

    dropout: Probability = 0.1


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
        shared, features, error = see(config, image, q, gripper)
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

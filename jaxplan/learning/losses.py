"""The predictor's loss (equations 1 to 3), on joints scaled to [-1, 1]."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float

from jaxplan.base import Subgoal
from jaxplan.networks import ERROR_SCALE, Prediction
from jaxplan.ranges import Checked, NotNegative, Positive


@dataclass(frozen=True)
class LossConfig(Checked):
    """Weights of equations 1 to 3, with the numbers of section 5.1."""

    w_q: NotNegative = 2.0
    w_g: NotNegative = 1.0
    w_s: NotNegative = 1.0
    w_r: NotNegative = 1e-4
    w_c: NotNegative = 1.0
    """Of the camera's error, where the network says it; not in the paper."""
    huber_kappa: Positive = 2.0
    lambda_lim: NotNegative = 1.0
    lambda_prox: NotNegative = 0.5
    delta: NotNegative = 0.02
    """Margin of the limit hinge, in joints scaled to [-1, 1]."""


def subgoal_loss(
    config: LossConfig,
    prediction: Prediction,
    targets: Subgoal,
    camera_error: Float[Array, "B 5"] | None = None,
) -> tuple[Float[Array, ""], dict[str, jax.Array]]:
    """Equation 1, averaged over the batch, and its terms before weighting.

    Args:
        config: Weights.
        prediction: Of the network; joints are scaled to [-1, 1].
        targets: Labels, likewise.
        camera_error: Labels, for a network that says it.
    """
    terms = {
        "toggle": huber(prediction.q_toggle - targets.q_toggle, config.huber_kappa),
        "gripper": optax.sigmoid_binary_cross_entropy(
            prediction.gripper_logit, targets.gripper_toggle.astype(jnp.float32)
        ),
        "goal": huber(prediction.q_goal - targets.q_goal, config.huber_kappa),
        "regularizer": regularizer(config, prediction.q_toggle, prediction.q_goal),
    }
    weights = [config.w_q, config.w_g, config.w_s, config.w_r]
    if prediction.camera_error is not None and camera_error is not None:
        off = (prediction.camera_error - camera_error) / ERROR_SCALE
        terms["camera"] = huber(off, config.huber_kappa)
        weights.append(config.w_c)
    means = {name: jnp.mean(term) for name, term in terms.items()}
    total = jnp.dot(jnp.array(weights), jnp.stack(list(means.values())))
    return total, means


def huber(error: Float[Array, "*B d"], kappa: float) -> Float[Array, "*B"]:
    """Element-wise Huber, averaged over the joints."""
    size = jnp.abs(error)
    inside = 0.5 * size**2
    return jnp.where(size <= kappa, inside, kappa * (size - 0.5 * kappa)).mean(-1)


def regularizer(
    config: LossConfig, q_toggle: Float[Array, "*B d"], q_goal: Float[Array, "*B d"]
) -> Float[Array, "*B"]:
    """R of equation 2: limits of both, and the distance between them."""
    limits = limit_hinge(q_toggle, config.delta) + limit_hinge(q_goal, config.delta)
    near = jnp.sum((q_goal - q_toggle) ** 2, axis=-1)
    return config.lambda_lim * limits + config.lambda_prox * near


def limit_hinge(q: Float[Array, "*B d"], delta: float) -> Float[Array, "*B"]:
    """R_lim of equation 3 with limits at -1 and 1: squared excess over 1 - delta."""
    return jnp.sum(jnp.maximum(0.0, jnp.abs(q) - (1.0 - delta)) ** 2, axis=-1)

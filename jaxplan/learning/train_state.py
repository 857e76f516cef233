"""What training carries from step to step."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import optax

from jaxplan.ranges import Checked, NotNegative, Positive, Probability, Whole


@dataclass(frozen=True)
class OptimizerConfig(Checked):
    """AdamW with warm-up and cosine decay to zero; EMA as in Diffusion Policy."""

    learning_rate: NotNegative = 1e-4
    warmup_steps: Whole = 500
    betas: tuple[Probability, Probability] = (0.95, 0.999)
    weight_decay: NotNegative = 1e-6
    gradient_clip: Positive = 1.0
    """Largest global norm of the gradient."""
    ema_power: Positive = 0.75
    ema_max: Probability = 0.9999


Params = Any
Loss = Callable[[Params, jax.Array, Any], tuple[jax.Array, dict[str, jax.Array]]]
"""loss(params, key, batch) -> (loss, metrics)."""


class TrainState(NamedTuple):
    """A pytree; together with the config it determines the rest of the run."""

    step: jax.Array
    """i32 [], optimiser steps taken."""
    params: Params
    ema_params: Params
    """Moving average of `params`: what is validated and exported."""
    opt_state: optax.OptState


def optimizer(config: OptimizerConfig, steps: int) -> optax.GradientTransformation:
    """AdamW under gradient clipping, with warm-up and a cosine down to zero."""
    warmup = min(config.warmup_steps, steps // 2)
    rate = optax.warmup_cosine_decay_schedule(0.0, config.learning_rate, warmup, steps)
    adamw = optax.adamw(
        rate, b1=config.betas[0], b2=config.betas[1], weight_decay=config.weight_decay
    )
    return optax.chain(optax.clip_by_global_norm(config.gradient_clip), adamw)


def init_state(params: Params, tx: optax.GradientTransformation) -> TrainState:
    """The state before the first step."""
    # A real copy: the step donates its state, and one buffer cannot be given away twice.
    ema = jax.tree.map(jnp.copy, params)
    return TrainState(jnp.zeros((), jnp.int32), params, ema, tx.init(params))


def ema_decay(step: jax.Array, config: OptimizerConfig) -> jax.Array:
    """clip(1 - (1 + k)^-power, 0, max), k = steps taken before this one."""
    return jnp.clip(1.0 - (1.0 + step) ** -config.ema_power, 0.0, config.ema_max)


def train_step(
    loss: Loss,
    tx: optax.GradientTransformation,
    config: OptimizerConfig,
    state: TrainState,
    key: jax.Array,
    batch: Any,
) -> tuple[TrainState, dict[str, jax.Array]]:
    """One step. `key` is the run's: the step's own is folded in, so resuming is exact."""
    key = jax.random.fold_in(key, state.step)
    (value, metrics), gradient = jax.value_and_grad(loss, has_aux=True)(
        state.params, key, batch
    )
    updates, opt_state = tx.update(gradient, state.opt_state, state.params)
    params = optax.apply_updates(state.params, updates)
    decay = ema_decay(state.step, config)
    ema = jax.tree.map(
        lambda e, p: decay * e + (1 - decay) * p, state.ema_params, params
    )
    return TrainState(state.step + 1, params, ema, opt_state), {
        "loss": value,
        **metrics,
    }

"""Policies whose networks say a mixture of chunks for each observation of a window."""

from typing import Any

import jax

from jaxplan.learning.policy import Act, Batch, PolicyTraining, examples, with_camera
from jaxplan.learning.train_state import Params
from jaxplan.networks import Window


def draw_with(network: Any) -> Act:
    """Chunks that follow the present observation."""

    def act(config: Any, params: Params, window: Window, keys: jax.Array) -> jax.Array:
        mixture, _ = network(config).apply(params, window)
        now = jax.tree.map(lambda x: x[:, -1], mixture)
        return jax.vmap(lambda one, key: one.draw(key))(now, keys)

    return act


def negative_log_likelihood(
    network: Any,
    config: PolicyTraining,
    params: Params,
    key: jax.Array,
    batch: Batch,
    **settings: Any,
) -> tuple[jax.Array, dict[str, jax.Array]]:
    """Of the chunks that follow every observation of a window, for each number of a chunk."""
    key_image, key_dropout = jax.random.split(key)
    window, x_0 = examples(config, key_image, batch)
    mixture, error = network(config.network).apply(
        params, window, rngs={"dropout": key_dropout}, **settings
    )
    numbers = x_0.shape[-1] * x_0.shape[-2]
    return with_camera(config, -mixture.log_prob(x_0).mean() / numbers, error, batch)

"""Drawing segments: units, and independence from the rest of the batch."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan.config import SamplerConfig
from jaxplan.networks import Cond, SamplerNetwork
from jaxplan.samplers import diffusion

draw = jax.jit(diffusion.draw, static_argnums=(0, 4))


def condition(batch: int) -> Cond:
    keys = jax.random.split(jax.random.key(1), 4)
    q, q_toggle, q_goal = (jax.random.normal(key, (batch, 7)) for key in keys[:3])
    mode = jnp.arange(batch) % 2
    image = jax.random.normal(keys[3], (batch, 12))
    return Cond(image, q, mode, q_toggle, 1 - mode, q_goal)


def weights(config: SamplerConfig) -> dict:
    params = jax.jit(SamplerNetwork(config).init)(
        jax.random.key(0), jnp.zeros((2, 8)), jnp.zeros(2, jnp.int32), condition(2)
    )
    return jax.tree.map(lambda p: p + 0.01, params)


@pytest.mark.parametrize("denoiser", ["unet1d", "film_mlp"])
def test_segments_are_segments(denoiser):
    config = SamplerConfig(denoiser=denoiser, hidden=(16, 32), encoder=None)
    keys = jax.random.split(jax.random.key(2), 3)
    segment = draw(config, weights(config), condition(3), keys, 5)
    assert segment.direction.shape == (3, 5, 7)
    np.testing.assert_allclose(np.linalg.norm(segment.direction, axis=-1), 1, atol=1e-5)
    assert np.all(segment.length >= 0.05 - 1e-6)
    assert np.all(segment.length <= 0.2 + 1e-6)


def test_a_problem_does_not_see_its_neighbours():
    config = SamplerConfig(denoiser="film_mlp", hidden=(16,), encoder=None)
    params, cond = weights(config), condition(4)
    keys = jax.random.split(jax.random.key(2), 4)
    whole = draw(config, params, cond, keys, 3)
    rows = jnp.array([2, 0])
    part = draw(config, params, jax.tree.map(lambda x: x[rows], cond), keys[rows], 3)
    np.testing.assert_allclose(part.direction, whole.direction[rows], atol=1e-4)
    np.testing.assert_allclose(part.length, whole.length[rows], atol=1e-4)

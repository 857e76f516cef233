"""The noise schedule against published numbers, DDIM against a closed form."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan import diffusion


def test_schedule_numbers():
    abar = diffusion.alphas_cumprod(100)
    table = {
        0: 0.99937,
        4: 0.9920,
        10: 0.9667,
        49: 0.4938,
        80: 0.0852,
        90: 0.0195,
        96: 2.18e-3,
        98: 2.43e-4,
        99: 2.43e-7,
    }
    for t, value in table.items():
        assert abar[t] == pytest.approx(value, rel=5e-3)
    betas = diffusion.squaredcos_cap_v2(100)
    assert betas[0] == pytest.approx(6.31e-4, rel=1e-2)
    assert betas[99] == 0.999
    assert np.all(np.diff(abar) < 0)


def test_leading_spacing():
    assert diffusion.timesteps(100, 25).tolist() == list(range(96, -1, -4))
    assert diffusion.timesteps(100, 10).tolist() == list(range(90, -1, -10))
    with pytest.raises(ValueError, match="num_inference_steps is 0"):
        diffusion.timesteps(100, 0)


@pytest.mark.parametrize("steps", [10, 25, 100])
def test_ddim_of_a_gaussian_is_its_closed_form(steps):
    """For x_0 ~ N(m, v) the optimal eps is linear, and so is every DDIM step."""
    mean, var = 0.3, 0.04
    abar = jnp.asarray(diffusion.alphas_cumprod(100))

    def denoise(x_t, t):
        a = abar[t]
        gain = jnp.sqrt(1 - a) / (a * var + 1 - a)
        return gain * (x_t - jnp.sqrt(a) * mean)

    noise = jax.random.normal(jax.random.key(0), (4096, 1))
    out = np.asarray(
        diffusion.ddim(denoise, noise, 100, diffusion.timesteps(100, steps))
    )
    # The same map in float64, as slope and offset.
    slope, offset = 1.0, 0.0
    chosen = np.float64(diffusion.alphas_cumprod(100)[diffusion.timesteps(100, steps)])
    for a, b in zip(chosen, [*chosen[1:], 1.0], strict=True):
        gain = np.sqrt(1 - a) / (a * var + 1 - a)
        x0_slope = (1 - np.sqrt(1 - a) * gain) / np.sqrt(a)
        x0_offset = np.sqrt(1 - a) * gain * mean
        factor = np.sqrt(b) * x0_slope + np.sqrt(1 - b) * gain
        shift = np.sqrt(b) * x0_offset - np.sqrt(1 - b) * gain * np.sqrt(a) * mean
        slope, offset = factor * slope, factor * offset + shift
    np.testing.assert_allclose(out, slope * np.asarray(noise) + offset, atol=2e-4)
    assert out.mean() == pytest.approx(mean, abs=0.03)
    # Few steps shrink the spread a little; this is a law of DDIM, not of the network.
    assert out.std() == pytest.approx(np.sqrt(var), rel=0.3)


def test_ddim_recovers_a_point_exactly():
    """Where x_0 is one known point, the last step lands on it."""
    point = jnp.array([0.5, -1.0, 0.2])
    abar = jnp.asarray(diffusion.alphas_cumprod(100))

    def denoise(x_t, t):
        return (x_t - jnp.sqrt(abar[t]) * point) / jnp.sqrt(1 - abar[t])

    noise = jax.random.normal(jax.random.key(1), (5, 3))
    out = diffusion.ddim(denoise, noise, 100, diffusion.timesteps(100, 25))
    np.testing.assert_allclose(out, jnp.broadcast_to(point, (5, 3)), atol=1e-4)


def test_clip_bounds_the_sample():
    noise = jax.random.normal(jax.random.key(2), (64, 8))
    steps = diffusion.timesteps(100, 10)
    out = diffusion.ddim(
        lambda x, t: -9.0 * x, noise, 100, steps, clip=diffusion.bounds(7)
    )
    assert np.all(np.abs(out) <= diffusion.bounds(7) + 1e-5)


def test_coding_is_inverted():
    key_u, key_s = jax.random.split(jax.random.key(3))
    u = jax.random.normal(key_u, (4, 5, 7))
    u = u / jnp.linalg.norm(u, axis=-1, keepdims=True)
    s = jax.random.uniform(key_s, (4, 5), minval=0.05, maxval=0.2)
    x_0 = diffusion.encode(u, s, 0.05, 0.2)
    assert np.all(np.abs(x_0) <= diffusion.bounds(7))
    direction, length = diffusion.decode(x_0, 7, 0.05, 0.2)
    np.testing.assert_allclose(direction, u, atol=1e-6)
    np.testing.assert_allclose(length, s, atol=1e-6)


def test_a_base_is_coded_beside_the_arm():
    q, base = jax.random.normal(jax.random.key(1), (2, 4, 7))
    segment = jnp.zeros((4, 8))
    x_0 = jnp.concatenate([segment, diffusion.encode_base(base, q, 0.7)], axis=-1)
    np.testing.assert_allclose(diffusion.decode_base(x_0, q, 0.7), base, atol=1e-6)
    assert diffusion.bounds(7, base=True).shape == x_0.shape[1:]


def test_decode_is_always_a_segment():
    x_0 = jnp.array([[0.0] * 7 + [9.0], [3.0] * 7 + [-9.0]])
    direction, length = diffusion.decode(x_0, 7, 0.05, 0.2)
    assert np.isfinite(direction).all()
    np.testing.assert_allclose(length, [0.2, 0.05], atol=1e-6)


def test_loss_of_the_true_noise_is_zero():
    x_0 = jax.random.normal(jax.random.key(4), (32, 8))
    abar = jnp.asarray(diffusion.alphas_cumprod(100))

    def denoise(x_t, t):
        a = abar[t][:, None]
        return (x_t - jnp.sqrt(a) * x_0) / jnp.sqrt(1 - a)

    assert diffusion.eps_loss(jax.random.key(5), denoise, x_0, 100) < 1e-4

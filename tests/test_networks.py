"""Networks: shapes, normalisations, and the matmul form of the convolutions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxplan.networks import (
    Cond,
    Encoder,
    EncoderConfig,
    Predictor,
    PredictorConfig,
    SamplerConfig,
    SamplerNetwork,
    joints,
    predict,
    resnet,
    unet1d,
)
from jaxplan.networks.mish import mish
from jaxplan.samplers import family_of

TINY = EncoderConfig(stem="patch4", width=4, blocks=(1, 1), keypoints=4, features=8)


def observation(batch: int):
    keys = jax.random.split(jax.random.key(0), 2)
    image = jax.random.randint(keys[0], (batch, 88, 136, 3), 0, 256).astype(jnp.uint8)
    q = jax.random.uniform(keys[1], (batch, 7), minval=-0.05, maxval=-0.07)
    return image, q, jnp.arange(batch) % 2


def condition(batch: int, features: int) -> Cond:
    keys = jax.random.split(jax.random.key(1), 4)
    q, q_toggle, q_goal = (jax.random.normal(key, (batch, 7)) for key in keys[:3])
    mode = jnp.arange(batch) % 2
    image = jax.random.normal(keys[3], (batch, features))
    return Cond(image, q, mode, q_toggle, 1 - mode, q_goal)


@pytest.mark.parametrize(
    ("strides", "cells"), [((2, 2), (3, 5)), ((2, 1), (6, 9)), ((1, 1), (11, 17))]
)
def test_output_map_of_the_strides(strides, cells):
    """methods: 88x136 pixels give 3x5, 6x9 or 11x17 cells."""
    config = EncoderConfig(width=4, last_strides=strides, keypoints=2)
    image = jnp.zeros((1, 88, 136, 3), jnp.uint8)
    _, state = jax.eval_shape(
        lambda key: Encoder(config).init_with_output(
            key, image, capture_intermediates=True, mutable=["params", "intermediates"]
        ),
        jax.random.key(0),
    )
    maps = state["intermediates"]["keypoints"]["__call__"][0]
    assert maps.shape == (1, *cells, 2)


def test_resnet18_has_its_known_size():
    image = jnp.zeros((1, 88, 136, 3), jnp.uint8)
    params = jax.eval_shape(
        lambda key: Encoder(EncoderConfig()).init(key, image), jax.random.key(0)
    )
    backbone = {
        k: v for k, v in params["params"].items() if k[:5] not in ("keypo", "Dense")
    }
    count = sum(leaf.size for leaf in jax.tree.leaves(backbone))
    assert count == pytest.approx(11.18e6, rel=2e-3)


def test_group_norm_has_16_channels_a_group():
    assert resnet.group_norm(64).num_groups == 4
    assert resnet.group_norm(8).num_groups == 1


def test_spatial_softmax_finds_a_peak():
    maps = jnp.zeros((1, 11, 17, 2)).at[0, 0, 16, 0].set(50.0).at[0, 5, 8, 1].set(50.0)
    np.testing.assert_allclose(
        resnet.spatial_softmax(maps)[0], [1.0, -1.0, 0.0, 0.0], atol=1e-5
    )


@pytest.mark.parametrize("stride", [1, 2])
def test_conv1d_equals_lax(stride):
    x = jax.random.normal(jax.random.key(0), (3, 8, 5))
    layer = unet1d.Conv1d(6, 3, stride)
    params = layer.init(jax.random.key(1), x)
    dense = params["params"]["Dense_0"]
    expected = lax.conv_general_dilated(
        x,
        dense["kernel"].reshape(3, 5, 6),
        (stride,),
        [(1, 1)],
        dimension_numbers=("NWC", "WIO", "NWC"),
    )
    np.testing.assert_allclose(layer.apply(params, x), expected, atol=1e-5)


def test_transposed_conv1d_equals_lax():
    """torch's out[j] = sum_i x[i] w[j - 2 i + 1]: even taps w3 w1, odd taps w2 w0."""
    x = jax.random.normal(jax.random.key(0), (3, 4, 5))
    layer = unet1d.ConvTranspose1d(6)
    params = layer.init(jax.random.key(1), x)
    w3, w1 = params["params"]["even"]["kernel"].reshape(2, 5, 6)
    w2, w0 = params["params"]["odd"]["kernel"].reshape(2, 5, 6)
    # A transposed convolution is a plain one over the dilated input, kernel flipped.
    expected = lax.conv_general_dilated(
        x,
        jnp.stack([w3, w2, w1, w0]),
        (1,),
        [(2, 2)],
        lhs_dilation=(2,),
        dimension_numbers=("NWC", "WIO", "NWC"),
    )
    assert expected.shape == (3, 8, 6)
    np.testing.assert_allclose(layer.apply(params, x), expected, atol=1e-5)


def test_unet_size():
    """methods: length 8, (64, 128, 256), kernel 3, cond 256 + step 128: 3.92 M."""
    config = SamplerConfig(encoder=None)
    network = SamplerNetwork(config)
    params = jax.eval_shape(
        network.init,
        jax.random.key(0),
        jnp.zeros((2, 8)),
        jnp.zeros(2, jnp.int32),
        condition(2, 64),
    )["params"]
    used = [params[name] for name in ("denoiser", "modulation", "step")]
    count = sum(leaf.size for leaf in jax.tree.leaves(used))
    assert count == pytest.approx(3.92e6, rel=0.02)


@pytest.mark.parametrize("denoiser", ["unet1d", "film_mlp"])
def test_film_table_equals_the_direct_path(denoiser):
    config = SamplerConfig(
        denoiser=denoiser, hidden=(16, 32), encoder=None, relative=True
    )
    network = SamplerNetwork(config)
    cond, t = condition(3, 12), jnp.array([0, 40, 96])
    x = jax.random.normal(jax.random.key(2), (3, 8))
    params = jax.jit(network.init)(jax.random.key(3), x, t, cond)
    params = jax.tree.map(
        lambda p: p + 0.01, params
    )  # past the zero-initialised output
    direct = jax.jit(network.apply)(params, x, t, cond)

    @jax.jit
    def by_table(params):
        vector = network.apply(params, cond, method="cond")
        table = network.apply(params, vector, t[:, None], method="film")
        rows = table[jnp.arange(3), jnp.arange(3)]
        return network.apply(params, x, rows, method="denoise")

    np.testing.assert_allclose(by_table(params), direct, atol=1e-5)
    assert np.ptp(np.asarray(direct), axis=0).max() > 1e-3


def test_predictor_shapes_and_limits():
    config = PredictorConfig(encoder=TINY, hidden=16)
    image, q, gripper = observation(3)
    params = jax.jit(Predictor(config).init)(jax.random.key(0), image, q, gripper)
    params = jax.tree.map(lambda p: 30.0 * p, params)  # far outside the limits
    subgoal, features = jax.jit(predict, static_argnums=0)(
        config, params, image, q, gripper
    )
    assert subgoal.q_toggle.shape == subgoal.q_goal.shape == (3, 7)
    assert features.shape == (3, 8)
    for q in (subgoal.q_toggle, subgoal.q_goal):
        assert np.all(q >= np.array(config.q_min) - 1e-6)
        assert np.all(q <= np.array(config.q_max) + 1e-6)


def test_dropout_only_in_training():
    config = PredictorConfig(encoder=TINY, hidden=16, dropout=0.5)
    net, inputs = Predictor(config), observation(2)
    params = jax.jit(net.init)(jax.random.key(0), *inputs)
    run = jax.jit(net.apply, static_argnames="train")
    plain = run(params, *inputs).q_toggle
    still = run(params, *inputs, rngs={"dropout": jax.random.key(1)}).q_toggle
    np.testing.assert_allclose(plain, still, atol=1e-6)
    noisy = run(params, *inputs, train=True, rngs={"dropout": jax.random.key(1)})
    assert np.abs(noisy.q_toggle - plain).max() > 1e-4


def test_joints_round_trip():
    limits = PredictorConfig().q_min, PredictorConfig().q_max
    np.testing.assert_allclose(joints.normalize(jnp.array(limits[0]), *limits), -1.0)
    np.testing.assert_allclose(joints.normalize(jnp.array(limits[1]), *limits), 1.0)
    q = jnp.linspace(-0.06, -0.05, 7)
    back = joints.unnormalize(joints.normalize(q, *limits), *limits)
    np.testing.assert_allclose(back, q, atol=1e-6)


def test_mish_equals_its_definition():
    x = jnp.concatenate([jnp.linspace(-30, 30, 601), jnp.array([-1e4, 1e4])])
    np.testing.assert_allclose(mish(x), jax.nn.mish(x), atol=1e-5)
    slope, expected = (jax.vmap(jax.grad(f))(x) for f in (mish, jax.nn.mish))
    np.testing.assert_allclose(slope, expected, atol=1e-5)


def test_a_config_of_no_network_is_refused():
    with pytest.raises(TypeError, match="EncoderConfig describes no sampler"):
        family_of(EncoderConfig())

"""Drawing segments: units, independence from the rest of the batch, closed forms."""

import pickle
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan import Planner, Scene, samplers
from jaxplan.config import PAPER_PLANNER
from jaxplan.networks import Cond, CvaeConfig, FewStepConfig, GanConfig, SamplerConfig
from jaxplan.pretrained import load_weights
from jaxplan.robots import PANDA
from jaxplan.samplers import Bank, few_step, init
from jaxplan.samplers.diffusion import noise

draw = jax.jit(samplers.draw, static_argnums=(0, 4))
CONFIGS = [
    SamplerConfig(denoiser="unet1d", hidden=(16, 32), encoder=None),
    SamplerConfig(denoiser="film_mlp", hidden=(16, 32), encoder=None),
    FewStepConfig(denoiser="film_mlp", hidden=(16,), encoder=None),
    CvaeConfig(hidden=(16, 16), encoder=None, relative=True),
    GanConfig(generator=(16, 16), discriminator=(8,), encoder=None),
]
WITH_BASE = [replace(config, tree_context=True) for config in CONFIGS[1:]]


def name_of(config) -> str:
    return type(config).__name__ + "_with_base" * config.tree_context


def condition(batch: int) -> Cond:
    keys = jax.random.split(jax.random.key(1), 4)
    q, q_toggle, q_goal = (jax.random.normal(key, (batch, 7)) for key in keys[:3])
    mode = jnp.arange(batch) % 2
    image = jax.random.normal(keys[3], (batch, 12))
    return Cond(image, q, mode, q_toggle, 1 - mode, q_goal)


def weights(config, training: bool = False) -> dict:
    params = jax.jit(init, static_argnums=(0, 2, 3))(
        config, jax.random.key(0), (12,), training
    )
    return jax.tree.map(lambda p: p + 0.01, params)


@pytest.mark.parametrize("config", CONFIGS + WITH_BASE, ids=name_of)
def test_segments_are_segments(config):
    keys = jax.random.split(jax.random.key(2), 3)
    segment = draw(config, weights(config), condition(3), keys, 5)
    assert segment.direction.shape == (3, 5, 7)
    np.testing.assert_allclose(np.linalg.norm(segment.direction, axis=-1), 1, atol=1e-5)
    assert np.all(segment.length >= 0.05 - 1e-6)
    assert np.all(segment.length <= 0.2 + 1e-6)
    assert np.ptp(segment.direction, axis=1).max() > 1e-3, "one and the same segment"
    if config.tree_context:
        assert segment.base.shape == (3, 5, 7)
        gap = np.abs(segment.base - condition(3).q[:, None])
        assert 1e-4 < gap.max() <= 3.0 + 1e-5, "bases are told relative to q_curr"
    else:
        assert segment.base is None


@pytest.mark.parametrize("config", CONFIGS[1:], ids=name_of)
def test_a_problem_does_not_see_its_neighbours(config):
    params, cond = weights(config), condition(4)
    keys = jax.random.split(jax.random.key(2), 4)
    whole = draw(config, params, cond, keys, 3)
    rows = jnp.array([2, 0])
    part = draw(config, params, jax.tree.map(lambda x: x[rows], cond), keys[rows], 3)
    np.testing.assert_allclose(part.direction, whole.direction[rows], atol=1e-4)
    np.testing.assert_allclose(part.length, whole.length[rows], atol=1e-4)


@pytest.mark.parametrize("config", CONFIGS[3:], ids=name_of)
def test_drawing_needs_no_weights_of_training(config):
    keys = jax.random.split(jax.random.key(2), 3)
    whole, part = weights(config, training=True)["params"], weights(config)["params"]
    assert set(part) < set(whole)
    kept = {"params": {name: whole[name] for name in part}}
    one = draw(config, {"params": whole}, condition(3), keys, 2)
    other = draw(config, kept, condition(3), keys, 2)
    np.testing.assert_array_equal(one.direction, other.direction)


@pytest.mark.parametrize("count", [1, 4])
def test_without_velocity_a_few_steps_only_scale_the_noise(count):
    """v = 0, as of fresh weights, makes every step a multiple of x_t."""
    config = FewStepConfig(
        denoiser="film_mlp", hidden=(16,), encoder=None, num_inference_steps=count
    )
    params = init(config, jax.random.key(0), (12,))
    keys = jax.random.split(jax.random.key(2), 3)
    x_T = noise(config, keys, 5, 8)[..., :7]
    segment = draw(config, params, condition(3), keys, 5)
    expected = x_T / jnp.linalg.norm(x_T, axis=-1, keepdims=True)
    np.testing.assert_allclose(segment.direction, expected, atol=2e-5)


@pytest.mark.parametrize("config", CONFIGS[1:], ids=name_of)
def test_without_temperature_all_segments_are_one(config):
    config = replace(config, temperature=0.0)
    keys = jax.random.split(jax.random.key(2), 3)
    # Weights all alike hear next to nothing, and clipping would take the rest.
    leaves, tree = jax.tree.flatten(weights(config))
    lots = jax.random.split(jax.random.key(3), len(leaves))
    moved = [
        leaf + 0.3 * jax.random.normal(lot, leaf.shape)
        for leaf, lot in zip(leaves, lots, strict=True)
    ]
    params = jax.tree.unflatten(tree, moved)
    segment = draw(config, params, condition(3), keys, 5)
    np.testing.assert_allclose(np.ptp(segment.direction, axis=1), 0, atol=1e-5)
    assert np.ptp(segment.direction, axis=0).max() > 1e-3, "the condition is not heard"


def test_few_steps_part_the_teachers_way():
    for count, steps in ((1, [96]), (2, [96, 48]), (4, [96, 72, 48, 24])):
        config = FewStepConfig(num_inference_steps=count)
        assert few_step.timesteps(config).tolist() == steps
    with pytest.raises(ValueError, match="num_inference_steps is 97"):
        few_step.timesteps(FewStepConfig(num_inference_steps=97))


@pytest.mark.long
def test_trained_weights_guide_the_public_planner():
    """By a bank under one observation: alone, in a batch and in a copy the same answer."""
    weights = load_weights("sampler")
    features = weights.params["params"]["condition"]["image_norm"]["scale"].shape
    spec, q = PANDA.spec(), PANDA.q_home
    for geom in [geom for geom in spec.geoms if geom.group == 3]:  # physics
        spec.delete(geom)
    spec.worldbody.add_geom(size=[0.05] * 3, pos=[0.5, -0.3, 0.5], conaffinity=4)
    goal = q + np.array([0.5, 0.6, 0.0, 0.3, 0.2, 0.0, 0.0])
    sampler = Bank(weights).seeing(np.zeros(features, np.float32), 0, 1)
    config = replace(PAPER_PLANNER, method="rrt", goal_bias=0.2)
    planner = Planner(Scene.from_mjcf(spec), config, sampler=sampler)
    alone = planner.plan(q, goal, seed=3)
    assert alone.solved, alone.reason
    batch = planner.plan_batch([q] * 3, [goal] * 3, [1, 3, 2])
    copy = pickle.loads(pickle.dumps(planner)).plan(q, goal, seed=3)
    for again in (batch[1], copy):
        np.testing.assert_array_equal(again.path, alone.path)
    with pytest.raises(ValueError, match="num_inference_steps 4: CvaeConfig has none"):
        Bank(load_weights("cvae"), num_inference_steps=4)

"""The samplers' losses by their laws; training, a kill, and weights of another network."""

import dataclasses
import runpy
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_demonstrations import demonstrations

from jaxplan import diffusion as maths
from jaxplan import learning, pretrained, tasks, train
from jaxplan.learning import loop, sampler
from jaxplan.pretrained import shipped
from jaxplan.samplers import FAMILIES, cvae, diffusion, few_step, gan, init

CONFIGS = Path(__file__).parents[1] / "configs"
DEBUG = runpy.run_path(str(CONFIGS / "debug.py"))
SAMPLERS = ["sampler", "cvae", "gan", "few_step"]
KEY = jax.random.key(3)


def phases() -> sampler.Phases:
    shard = demonstrations()
    image = np.random.default_rng(0).normal(size=(len(shard.q), 12)).astype("f")
    return sampler.gather(shard, image, np.flatnonzero(shard.path >= 0))


def weights(kind: str, training: bool = True) -> dict:
    return init(DEBUG[kind].network, jax.random.key(0), (12,), training)


@pytest.mark.long
def test_a_gan_has_two_players():
    """Neither network's gradient contains the other's loss."""
    params, batch = weights("gan"), phases()
    total = jax.grad(lambda p: gan.loss(DEBUG["gan"], p, KEY, batch)[0])(params)

    def part(params, *names):
        return sum(gan.loss(DEBUG["gan"], params, KEY, batch)[1][n] for n in names)

    own = {
        "discriminator": jax.grad(part)(params, "discriminator", "penalty"),
        "generator": jax.grad(part)(params, "generator"),
    }
    for name, gradient in own.items():
        for a, b in zip(
            jax.tree.leaves(total["params"][name]),
            jax.tree.leaves(gradient["params"][name]),
            strict=True,
        ):
            np.testing.assert_allclose(a, b, atol=1e-6)


def test_a_latent_that_is_the_prior_costs_nothing():
    """KL of N(0, I) is 0; of N(m, I) it is half of m squared."""
    params, batch = weights("cvae"), phases()
    last = params["params"]["recognition"]["Dense_3"]
    last |= {"kernel": jnp.zeros_like(last["kernel"])}
    assert float(cvae.loss(DEBUG["cvae"], params, KEY, batch)[1]["kl"]) == 0
    latent = DEBUG["cvae"].network.latent
    last["bias"] = jnp.arange(2.0 * latent) * (jnp.arange(2 * latent) < latent)
    expected = 0.5 * sum(i * i for i in range(latent))
    kl = float(cvae.loss(DEBUG["cvae"], params, KEY, batch)[1]["kl"])
    assert kl == pytest.approx(expected, rel=1e-5)


def test_a_pupil_learns_where_its_teacher_ends():
    """Fresh teacher: eps = 0, so x_T / sqrt(abar) clipped. Fresh pupil: v = 0."""
    batch = phases()
    teacher = learning.Weights(DEBUG["sampler"].network, weights("sampler"), {})
    _, parts = few_step.loss(
        DEBUG["few_step"], teacher, weights("few_step"), KEY, batch
    )
    x_T = jax.random.normal(jax.random.split(KEY)[1], (len(batch.cond.q), 1, 8))
    scale = np.sqrt(maths.alphas_cumprod(100))
    x_0 = jnp.clip(x_T / scale[96], -maths.bounds(7), maths.bounds(7))
    expected = {"error_96": x_T * scale[96] - x_0}
    expected |= {f"error_{t}": x_0 * (scale[t] ** 2 - 1) for t in (72, 48, 24)}
    for name, error in expected.items():
        expected_mean = float(jnp.mean(error**2))
        assert float(parts[name]) == pytest.approx(expected_mean, rel=1e-3)


@pytest.fixture(scope="module")
def trained(demos, tmp_path_factory):
    """All samplers from the debug recipe, through the door."""
    root = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(root)
        for kind in ("predictor", *SAMPLERS):
            assert train.main([*command(kind, demos), "--out", "weights"]) == 0
    return root / "weights"


def command(kind: str, demos: str) -> list[str]:
    more = [] if kind == "predictor" else ["--predictor", "weights"]
    more += ["--teacher", "weights"] if kind == "few_step" else []
    return [kind, "--config", str(CONFIGS / "debug.py"), "--data", demos, *more]


@pytest.mark.parametrize("kind", SAMPLERS)
@pytest.mark.long
def test_the_door_trains_every_sampler(kind, trained):
    upper, lower = pretrained.load_pair(trained, kind)
    assert lower.config == DEBUG[kind].network
    assert lower.info["predictor_sha256"] == upper.info["sha256"]
    assert {"precision_median", "coverage_median"} <= set(lower.info["metrics"])
    lower.check_fits("a test's", "hand", "panda")


@pytest.mark.parametrize("kind", SAMPLERS)
def test_a_killed_training_ends_with_the_same_bits(
    kind,
    trained,
    demos,
    tmp_path,
    monkeypatch,
):
    monkeypatch.chdir(trained.parent)
    arguments = [*command(kind, demos), "--name", f"{tmp_path}/cut"]
    rows = loop.rows_of_step

    def killed(config, given, step):
        if step == 14:
            raise KeyboardInterrupt
        return rows(config, given, step)

    with monkeypatch.context() as patch:
        patch.setattr(loop, "rows_of_step", killed)
        with pytest.raises(KeyboardInterrupt):
            train.main(arguments)
    assert train.main([*arguments, "--out", str(tmp_path)]) == 0
    whole, cut = (pretrained.load_weights(kind, d).params for d in (trained, tmp_path))
    jax.tree.map(np.testing.assert_array_equal, whole, cut)


def test_weights_of_another_network_are_refused(trained, tmp_path):
    """By name and shape, also where the checksum is right."""
    params = pretrained.load_weights("cvae", trained).params
    small = dataclasses.replace(DEBUG["cvae"].network, latent=2)
    pretrained.save_weights(tmp_path, "cvae", params, small, {})
    with pytest.raises(
        learning.WeightsError,
        match=r"another network: .*decoder/Dense_0/kernel is \(3, 32\), .* \(2, 32\)",
    ):
        pretrained.load_weights("cvae", tmp_path)


def test_weights_of_another_task_camera_or_robot_are_refused():
    info = {"file": "gan.npz", "tasks": ["mug"], "cameras": ["hand"]}
    network = learning.Weights(None, {}, info)
    network.check_fits("mug", "hand", "panda")
    with pytest.raises(learning.WeightsError, match=r"gan.npz .* mug, not mug_cl"):
        network.check_fits("mug_cluttered", "hand", "panda")
    with pytest.raises(learning.WeightsError, match=r"for camera hand, not static"):
        network.check_fits("mug", "static", "panda")
    other = network._replace(info=info | {"robots": ["panda"]})
    with pytest.raises(learning.WeightsError, match=r"for robot panda, not ur5e"):
        other.check_fits("mug", "hand", "ur5e")
    network._replace(info={}).check_fits(
        "mug_cluttered", "static", "x"
    )  # older: unknown


def test_shipped_weights_say_what_they_are_for():
    for variant in tasks.TASKS["mug"].variants:
        task = tasks.check("mug", variant)
        for name in ("predictor", *FAMILIES):
            info = pretrained.load_weights(name, shipped(variant)).info
            assert (info["cameras"], info["robots"]) == (["hand"], ["panda"])
            assert task in info["tasks"]


def test_a_pupil_needs_its_teachers_predictor(trained, demos, tmp_path, capsys):
    upper = pretrained.load_weights("predictor", trained)
    other = jax.tree.map(lambda p: p + 1, upper.params)
    pretrained.save_weights(tmp_path, "predictor", other, upper.config, {})
    arguments = command("few_step", demos)
    arguments[arguments.index("--predictor") + 1] = str(tmp_path)
    arguments[arguments.index("--teacher") + 1] = str(trained)
    assert train.main(arguments) == 2
    assert "another predictor's features" in capsys.readouterr().err


def test_losses_have_gradients_for_all_of_their_weights():
    batch = phases()
    teacher = learning.Weights(DEBUG["sampler"].network, weights("sampler"), {})
    losses = {
        "sampler": partial(diffusion.loss, DEBUG["sampler"]),
        "cvae": partial(cvae.loss, DEBUG["cvae"]),
        "gan": partial(gan.loss, DEBUG["gan"]),
        "few_step": partial(few_step.loss, DEBUG["few_step"], teacher),
    }
    for kind, loss in losses.items():
        # past the zero-initialised output, which lets nothing through
        params = jax.tree.map(lambda p: p + 0.01, weights(kind))
        gradient = jax.grad(lambda p, loss=loss: loss(p, KEY, batch)[0])(params)
        for path, leaf in jax.tree.leaves_with_path(gradient):
            assert np.isfinite(leaf).all()
            assert np.abs(leaf).max() > 0, (kind, jax.tree_util.keystr(path))

"""Losses against their formulas, segments against their law, training against a kill."""

import dataclasses
import json
import os
import runpy
import subprocess
import sys
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from toy_demonstrations import demonstrations
from toy_training import TOY, toy

from jaxplan import data, learning, pretrained, train
from jaxplan.base import Subgoal
from jaxplan.config import from_dict
from jaxplan.learning import (
    AugmentConfig,
    LossConfig,
    OptimizerConfig,
    PredictorTraining,
    augment,
    checkpoint,
    loop,
    losses,
    predictor,
    segments,
)
from jaxplan.learning.train_state import (
    ema_decay,
    init_state,
    optimizer,
    train_step,
)
from jaxplan.networks import Prediction
from jaxplan.pretrained import store
from jaxplan.trainings import trainings

CONFIGS = Path(__file__).parents[1] / "configs"


# Losses


def test_loss_is_equation_1():
    """Written out element by element in NumPy."""
    rng = np.random.default_rng(0)
    config = LossConfig(huber_kappa=0.5, delta=0.1)
    toggle, goal, want_toggle, want_goal = rng.normal(size=(4, 5, 7))
    logit, mode = rng.normal(size=5), np.array([0, 1, 1, 0, 1])
    value, _ = losses.subgoal_loss(
        config,
        Prediction(*map(jnp.asarray, (toggle, logit, goal, toggle))),
        Subgoal(*map(jnp.asarray, (want_toggle, mode, want_goal))),
    )

    def huber(e):
        return 0.5 * e * e if abs(e) <= 0.5 else 0.5 * (abs(e) - 0.25)

    expected = 0.0
    for b in range(5):
        p = 1 / (1 + np.exp(-logit[b]))
        cross_entropy = -np.log(p if mode[b] else 1 - p)
        limits = sum(
            max(0, x - 0.9) ** 2 + max(0, -0.9 - x) ** 2 for x in (*toggle[b], *goal[b])
        )
        near = np.sum((goal[b] - toggle[b]) ** 2)
        expected += (
            2.0 * np.mean([huber(e) for e in toggle[b] - want_toggle[b]])
            + 1.0 * cross_entropy
            + 1.0 * np.mean([huber(e) for e in goal[b] - want_goal[b]])
            + 1e-4 * (limits + 0.5 * near)
        )
    assert float(value) == pytest.approx(expected / 5, rel=1e-5)


def test_augmentation_off_is_the_identity():
    image = jax.random.randint(jax.random.key(0), (2, 8, 8, 3), 0, 256).astype(
        jnp.uint8
    )
    off = AugmentConfig(brightness=0, contrast=0, noise=0)
    same = augment.photometric(jax.random.key(1), image, off)
    np.testing.assert_array_equal(same, image)
    other = augment.photometric(jax.random.key(1), image, AugmentConfig())
    assert 0 < np.abs(np.int32(other) - np.int32(image)).mean() < 40


def test_ema_decay_numbers():
    config = OptimizerConfig()
    assert float(ema_decay(jnp.array(0), config)) == 0.0
    for step, value in ((100, 0.969), (1000, 0.9944), (10_000, 0.9990)):
        assert float(ema_decay(jnp.array(step), config)) == pytest.approx(
            value, abs=1e-3
        )


def test_a_step_averages_the_weights_and_draws_anew():
    """By hand: three steps of plain descent on a noisy line, their average and their noise."""
    config = OptimizerConfig(ema_power=0.5)
    tx = optax.sgd(0.1)

    def slope(params, key, batch):
        noise = jax.random.normal(key)
        return params * (batch + noise), {"noise": noise}

    state, key = init_state(jnp.array(1.0), tx), jax.random.key(3)
    value, average = 1.0, 1.0
    for step in range(3):
        state, metrics = train_step(slope, tx, config, state, key, jnp.array(2.0))
        noise = float(jax.random.normal(jax.random.fold_in(key, step)))
        assert float(metrics["noise"]) == pytest.approx(noise)
        value -= 0.1 * (2.0 + noise)
        decay = 1 - (1 + step) ** -0.5
        average = decay * average + (1 - decay) * value
        assert float(state.params) == pytest.approx(value, abs=1e-6)
        assert float(state.ema_params) == pytest.approx(average, abs=1e-6)
    assert int(state.step) == 3


# Segments


def test_segments_lie_on_the_path():
    """base and base + s u are points of the path, s is within its bounds, in order."""
    rng = np.random.default_rng(1)
    circle = np.linspace(0, 1.2, 64)
    path = np.zeros((64, 7), np.float32)
    path[:, 0], path[:, 3] = np.cos(circle), np.sin(circle)
    rows = 256
    arc = rng.uniform(0, 1.1, rows).astype(np.float32)
    paths = segments.PathRows(
        jnp.asarray(np.tile(path, (rows, 1, 1))), jnp.full(rows, 1.2), jnp.asarray(arc)
    )
    base, segment = segments.training_segments(jax.random.key(0), paths, 0.05, 0.2)
    target = base + segment.length[:, None] * segment.direction
    np.testing.assert_allclose(np.linalg.norm(segment.direction, axis=1), 1, atol=1e-5)
    for point in (base, target):
        np.testing.assert_allclose(np.hypot(point[:, 0], point[:, 3]), 1, atol=1e-3)
    angle = np.arctan2(base[:, 3], base[:, 0])
    after = np.arctan2(target[:, 3], target[:, 0])
    assert np.all(angle >= arc - 1e-3)
    assert np.all(angle <= 1.15 + 1e-3)
    assert np.all(after <= 1.2 + 1e-3)
    assert np.all((after - angle >= 0.05 - 1e-3) & (after - angle <= 0.2 + 1e-3))
    # Uniform between the frame and the end, so half of the way on average.
    assert np.mean((angle - arc) / (1.15 - arc)) == pytest.approx(0.5, abs=0.06)


def test_frames_without_a_way_to_go_are_left_out():
    shard = demonstrations()
    shard = shard._replace(arc=shard.arc.copy())
    shard.arc[0] = shard.path_length[0] - 0.04
    rows = segments.eligible(shard, 0.05)
    assert 0 not in rows
    assert np.all(shard.path[rows] != data.NO_PATH)
    assert len(rows) == 3 * 8 - 1


def test_targets_that_are_one_point_stay_one():
    from jaxplan.learning.sampler import perturb_targets
    from jaxplan.networks import Cond

    q = jax.random.normal(jax.random.key(0), (2, 7))
    cond = Cond(q, q, q[:, 0], q, q[:, 0], q.at[1].add(0.3))
    out = perturb_targets(jax.random.key(1), cond, 0.02)
    np.testing.assert_array_equal(out.q_toggle[0], out.q_goal[0])
    noise = np.asarray(out.q_goal[1] - cond.q_goal[1])
    assert np.abs(noise - (out.q_toggle[1] - cond.q_toggle[1])).max() > 1e-3
    assert 0.005 < noise.std() < 0.05


# The loop


def test_an_epoch_is_a_permutation_and_depends_on_the_seed_only():
    config = PredictorTraining(batch_size=5, seed=3)
    rows = np.arange(100, 123)
    epoch = np.concatenate([loop.rows_of_step(config, rows, s) for s in range(4)])
    assert len(set(epoch)) == 20
    again = loop.rows_of_step(config, rows, 2)
    np.testing.assert_array_equal(again, epoch[10:15])
    assert not np.array_equal(loop.rows_of_step(config, rows, 6), again)


def test_held_out_episodes_do_not_depend_on_how_many_there_are():
    few, many = np.arange(40), np.arange(80)
    held_few = set(few[loop.held_out(few, 0.1)])
    held_many = set(many[loop.held_out(many, 0.1)])
    assert len(held_few) == 4
    assert len(held_many) == 8
    assert held_many & set(few) <= held_few


def test_kill_and_resume_equals_uninterrupted(tmp_path):
    whole, _ = toy(TOY, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        toy(TOY, tmp_path / "cut", stop=17)
    assert checkpoint.latest(tmp_path / "cut/checkpoints") == 10
    resumed, _ = toy(TOY, tmp_path / "cut")
    for a, b in zip(jax.tree.leaves(whole), jax.tree.leaves(resumed), strict=True):
        np.testing.assert_array_equal(a, b)

    def lines(run):
        text = (tmp_path / run / "metrics.jsonl").read_text().splitlines()
        rows = [json.loads(line) for line in text]
        return [{k: v for k, v in r.items() if "per_second" not in k} for r in rows]

    assert lines("whole") == lines("cut")


def test_non_finite_loss_keeps_the_last_good_checkpoint(tmp_path):
    with pytest.raises(learning.TrainingDiverged, match="not finite by step 15"):
        toy(TOY, tmp_path, poison=12)
    store = tmp_path / "checkpoints"
    assert checkpoint.latest(store) == 10
    like = init_state({"w": jnp.zeros(())}, optimizer(TOY.optimizer, TOY.steps))
    kept = checkpoint.restore(store, 10, like)
    assert int(kept.step) == 10
    assert np.isfinite(kept.params["w"])


PARALLEL = """
import jax, numpy as np, sys
import toy_training as t
from pathlib import Path
assert len(jax.devices()) == 2
state, _ = t.toy(t.TOY, Path(sys.argv[1]))
assert len(state.params["w"].sharding.device_set) == 2
"""


def test_two_devices_learn_what_one_does(tmp_path):
    """Data-parallel over two devices of the host: the same losses, up to rounding."""
    toy(TOY, tmp_path / "one")
    done = subprocess.run(
        [sys.executable, "-c", PARALLEL, str(tmp_path / "two")],
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join(
                [str(CONFIGS.parent), str(Path(__file__).parent)]
            ),
            "XLA_FLAGS": "--xla_force_host_platform_device_count=2",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]

    def losses_of(run):
        rows = map(
            json.loads, (tmp_path / run / "metrics.jsonl").read_text().splitlines()
        )
        return [row["loss"] for row in rows if "loss" in row]

    np.testing.assert_allclose(losses_of("two"), losses_of("one"), rtol=1e-5)


def test_a_run_is_not_resumed_with_other_settings(tmp_path):
    toy(TOY, tmp_path)
    with pytest.raises(learning.RunError, match="another batch_size"):
        toy(dataclasses.replace(TOY, batch_size=4), tmp_path)


def test_flipped_bit_in_a_checkpoint_is_detected(tmp_path):
    state = {"w": jnp.arange(1000.0)}
    checkpoint.save(tmp_path, 3, state)
    restored = checkpoint.restore(tmp_path, 3, state)
    np.testing.assert_array_equal(restored["w"], state["w"])
    largest = max(
        (tmp_path / "3").rglob("*"), key=lambda p: p.is_file() * p.stat().st_size
    )
    content = bytearray(largest.read_bytes())
    content[len(content) // 2] ^= 1
    largest.write_bytes(content)
    with pytest.raises(learning.CheckpointError, match="damaged checkpoint"):
        checkpoint.restore(tmp_path, 3, state)


def test_half_a_checkpoint_does_not_count(tmp_path):
    for step in (1, 2, 3):
        checkpoint.save(tmp_path, step, {"w": jnp.ones(3) * step})
    assert sorted(p.name for p in tmp_path.iterdir() if p.is_dir()) == ["2", "3"]
    (tmp_path / "3.sha256.json").unlink()
    assert checkpoint.latest(tmp_path) == 2


# Weights


def test_weights_round_trip_and_damage(tmp_path):
    config = runpy.run_path(str(CONFIGS / "debug.py"))["predictor"].network
    frames = predictor.gather(demonstrations(), np.arange(1))
    params = predictor.init(config, jax.random.key(0), frames)
    path = pretrained.save_weights(
        tmp_path, "predictor", params, config, {"metrics": {}}
    )
    weights = pretrained.load_weights("predictor", tmp_path)
    assert weights.config == config
    same = partial(np.testing.assert_allclose, rtol=2.0**-17)
    jax.tree.map(same, weights.params, params)
    again = pretrained.save_weights(tmp_path / "2", "predictor", *weights[:2][::-1], {})
    assert again.read_bytes() == path.read_bytes()
    with pytest.raises(learning.WeightsError, match="no sampler in"):
        pretrained.load_weights("sampler", tmp_path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)
    with pytest.raises(learning.WeightsError, match="damaged weights"):
        pretrained.load_weights("predictor", tmp_path)
    path.unlink()
    with pytest.raises(learning.WeightsError, match="missing weights"):
        pretrained.load_weights("predictor", tmp_path)
    (tmp_path / store.MANIFEST).write_text("{")
    with pytest.raises(learning.WeightsError, match="damaged manifest"):
        pretrained.load_weights("predictor", tmp_path)


def test_configs_survive_json():
    for kind in trainings().values():
        values = json.loads(json.dumps(dataclasses.asdict(kind.settings)))
        assert from_dict(type(kind.settings), values) == kind.settings
    with pytest.raises(ValueError, match="has no colour"):
        from_dict(LossConfig, {"colour": 1})


# The door


@pytest.mark.long
def test_the_door_trains_both_networks(demos, tmp_path, monkeypatch):
    """The debug recipe from demonstrations to weights, and a resume that has nothing to do."""
    monkeypatch.chdir(tmp_path)
    common = [
        "--config",
        str(CONFIGS / "debug.py"),
        "--data",
        demos,
        "--out",
        "weights",
    ]
    for kind, extra in (("predictor", []), ("sampler", ["--predictor", "weights"])):
        assert train.main([kind, *common, *extra]) == 0
    upper, lower = pretrained.load_pair("weights")
    assert upper.config.hidden == 32
    assert lower.info["predictor_sha256"] == upper.info["sha256"]
    assert Path(demos).name in upper.info["data"]
    before = Path("weights/predictor.npz").read_bytes()
    assert train.main(["predictor", *common]) == 0
    assert Path("weights/predictor.npz").read_bytes() == before
    lines = Path("runs/debug_predictor/metrics.jsonl").read_text().splitlines()
    losses = [json.loads(x)["loss"] for x in lines if "loss" in json.loads(x)]
    assert losses[-1] < losses[0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["planner"], "predictor, sampler, few_step"),
        (["predictor", "--stepz", "3"], "did you mean --steps"),
        (["predictor", "--network.hiden", "3"], "did you mean --network.hidden"),
        (
            ["predictor", "--config", str(CONFIGS / "debgu.py")],
            r"did you mean .*debug\.py",
        ),
        (["predictor", "--data", "/none"], "no such data directory: /none"),
        (
            ["sampler", "--config", str(CONFIGS / "compact.py"), "--predictor", "/no"],
            "missing weights",
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    arguments, message, capsys, tmp_path, monkeypatch
):
    import re

    monkeypatch.chdir(tmp_path)
    assert train.main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert re.search(message, error)


@pytest.mark.slow
def test_killed_process_resumes(demos, tmp_path):
    """`kill -9` in the middle of a real run, then the same command again."""
    import os
    import time

    command = [sys.executable, "-m", "jaxplan.train", "predictor"]
    command += ["--config", str(CONFIGS / "debug.py"), "--data", demos, "--steps", "40"]
    environment = {**os.environ, "PYTHONPATH": str(CONFIGS.parent)}
    outputs = []
    for name in ("whole", "cut"):
        run = tmp_path / name
        run.mkdir()
        if name == "cut":
            with subprocess.Popen(
                command, cwd=run, env=environment, stderr=subprocess.DEVNULL
            ) as process:
                store = run / "runs/debug_predictor/checkpoints"
                while checkpoint.latest(store) is None and process.poll() is None:
                    time.sleep(0.05)
                process.kill()
        subprocess.run(
            command, cwd=run, env=environment, check=True, stderr=subprocess.DEVNULL
        )
        weights = pretrained.load_weights(
            "predictor", run / "runs/debug_predictor/weights"
        )
        outputs.append(jax.tree.leaves(weights.params))
    for a, b in zip(*outputs, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)


@pytest.mark.long
def test_training_starts_from_given_weights(demos, tmp_path, monkeypatch, capsys):
    """With a learning rate of zero, what comes out is what went in."""
    monkeypatch.chdir(tmp_path)
    config = runpy.run_path(str(CONFIGS / "debug.py"))["predictor"].network
    frames = predictor.gather(demonstrations(), np.arange(1))
    params = predictor.init(config, jax.random.key(5), frames)
    pretrained.save_weights("first", "predictor", params, config, {})
    command = ["predictor", "--config", str(CONFIGS / "debug.py"), "--data", demos]
    still = ["--steps", "1", "--optimizer.learning-rate", "0", "--init", "first"]
    assert train.main([*command, *still, "--out", "second"]) == 0
    first, second = (
        jax.tree.leaves(pretrained.load_weights("predictor", name).params)
        for name in ("first", "second")
    )
    for a, b in zip(first, second, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    other = [*still, "--network.hidden", "16", "--name", "other"]
    assert train.main([*command, *other]) == 2
    said = capsys.readouterr().err
    assert "weights: second/predictor.npz" in said
    assert "error: first holds a predictor" in said
    assert "see params/" in said


@pytest.mark.long
def test_a_calibrating_predictor_starts_from_one_that_does_not(
    demos, tmp_path, monkeypatch
):
    """The weights that are there are taken, the camera's head is new; not the other way round."""
    monkeypatch.chdir(tmp_path)
    for name, calibrates in (("plain", False), ("calibrating", True)):
        Path(f"{name}.py").write_text(
            "import runpy\n"
            "from dataclasses import replace\n"
            "from jaxplan.networks import HandCameraConfig\n"
            f"debug = runpy.run_path({str(CONFIGS / 'debug.py')!r})['predictor']\n"
            "network = replace(debug.network, camera=HandCameraConfig())\n"
            f"network = replace(network, calibrates={calibrates})\n"
            f"predictor = replace(debug, network=network, name={name!r})\n"
        )
    command = ["--data", demos, "--steps", "1", "--optimizer.learning-rate", "0"]

    def run(name: str, *options: str) -> int:
        return train.main(["predictor", "--config", f"{name}.py", *command, *options])

    assert run("plain", "--seed", "3", "--out", "first") == 0
    assert run("calibrating", "--init", "first", "--out", "second") == 0
    first, second = (
        pretrained.load_weights("predictor", name) for name in ("first", "second")
    )
    assert second.config.calibrates
    known = jax.tree_util.tree_leaves_with_path(first.params)
    more = dict(jax.tree_util.tree_leaves_with_path(second.params))
    for place, leaf in known:
        np.testing.assert_allclose(leaf, more[place], atol=1e-6)
    assert "camera_error" in second.params["params"]
    assert run("plain", "--init", "second", "--name", "back") == 2


def test_exported_weights_are_shortened_to_16_bits_of_mantissa(tmp_path):
    rng = np.random.default_rng(0)
    x = (rng.normal(size=4096) * 10.0 ** rng.integers(-30, 30, 4096)).astype(np.float32)
    short = store._shortened(x)
    assert np.all(np.abs(short - x) <= np.abs(x) * 2.0**-17)
    assert np.all(short.view(np.uint32) & 0x7F == 0)
    np.testing.assert_array_equal(store._shortened(short), short)
    special = np.array([0.0, -0.0, 1.0, np.inf, -np.inf], np.float32)
    np.testing.assert_array_equal(store._shortened(special), special)

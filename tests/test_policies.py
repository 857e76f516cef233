"""Policies: windows, chunks, the interface that executes them, and the registry."""

import runpy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import flax.linen as nn
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import norm
from toy_timed import JOINTS, timed

from jaxplan import data, policies, train
from jaxplan.base import Observation
from jaxplan.learning import Weights, WeightsError, loop
from jaxplan.learning.augment import AugmentConfig
from jaxplan.learning.policy import (
    PolicyTraining,
    Windows,
    examples,
    fitted,
    weighted,
)
from jaxplan.learning.predictor import encodings
from jaxplan.networks import (
    Chunk,
    HandCameraConfig,
    PolicyConfig,
    Predictor,
    decode,
    encode,
)
from jaxplan.networks.mixture import Mixture
from jaxplan.policies import POLICIES, Drive, Policy, PolicyAgent, Step
from jaxplan.pretrained import load_weights, save_weights
from jaxplan.robots import PANDA
from jaxplan.trainings import files

CONFIGS = Path(__file__).parents[1] / "configs"
CONFIG = PolicyConfig(history=3, horizon=4, executed=2)


def test_windows_end_with_their_episode():
    """The first frame is repeated before the start, the last action after the end."""
    shard = timed(episodes=2, frames=5)
    batch = Windows(shard, CONFIG)(np.array([0, 5, 9]))
    np.testing.assert_array_equal(
        batch.window.q, shard.q[[[0, 0, 0], [5, 5, 5], [7, 8, 9]]]
    )
    np.testing.assert_array_equal(batch.window.image[2], shard.image[7:10])
    now = batch.chunk.q[:, -1]
    np.testing.assert_array_equal(now[0], shard.action_q[:4])
    np.testing.assert_array_equal(now[2], shard.action_q[[9, 9, 9, 9]])
    np.testing.assert_array_equal(batch.chunk.q[2, 0], shard.action_q[[7, 8, 9, 9]])


@pytest.mark.parametrize("relative", [True, False])
def test_a_chunk_comes_back(relative):
    shard = timed()
    config = fitted(replace(CONFIG, relative=relative), shard)
    batch = Windows(shard, config)(np.arange(len(shard.q)))
    x = encode(
        config, jnp.asarray(batch.window.q), Chunk(*map(jnp.asarray, batch.chunk))
    )
    assert jnp.abs(x).max() <= 1 + 1e-5
    assert jnp.abs(x).max((0, 1, 2)).min() > 0.99, "the range is the demonstrations'"
    back = decode(config, jnp.asarray(batch.window.q), x)
    np.testing.assert_allclose(back.q, batch.chunk.q, atol=1e-5)
    np.testing.assert_array_equal(back.gripper, batch.chunk.gripper)


def test_toggles_are_seen_more_often():
    shard = timed(episodes=2, frames=10)
    toggles = np.flatnonzero(shard.gripper != shard.action_gripper)
    assert toggles.tolist() == [5, 15]
    config = LineTraining(near_toggle=1, toggle_weight=3)
    rows = weighted(config, shard, np.arange(20))
    count = np.bincount(rows)
    assert set(np.flatnonzero(count == 3)) == {4, 5, 6, 14, 15, 16}
    assert (count[count != 3] == 1).all()


def test_a_mixtures_likelihood_is_scipys():
    keys = iter(jax.random.split(jax.random.key(0), 5))
    mixture = Mixture(
        jax.random.normal(next(keys), (3,)),
        jax.random.normal(next(keys), (3, 4, 7)),
        0.1 + jax.random.uniform(next(keys), (3, 4, 7)),
        jax.random.normal(next(keys), (3, 4)),
    )
    x = jnp.concatenate(
        [jax.random.normal(next(keys), (4, 7)), jnp.array([[1.0], [-1], [1], [-1]])], 1
    )
    each = [
        norm(mixture.mean[m], mixture.std[m]).logpdf(x[:, :7]).sum()
        - np.log1p(np.exp(-x[:, 7] * mixture.gripper[m])).sum()
        for m in range(3)
    ]
    weights = mixture.logits - logsumexp(mixture.logits)
    np.testing.assert_allclose(
        mixture.log_prob(x), logsumexp(weights + np.array(each)), rtol=1e-5
    )
    drawn = mixture.draw(jax.random.key(1))
    assert any(np.array_equal(drawn[:, :7], mean) for mean in mixture.mean)


class Still:
    """A task whose arms are nowhere near their terminal region."""

    name, camera, batch, robot = "mug", "hand", 2, PANDA

    def in_terminal_region(self, lane):
        return False


def observation(q):
    q = np.asarray(q, np.float32)
    return Observation({"hand": np.zeros((2, 1, 1, 3))}, q, np.zeros(2, np.uint8))


def test_what_leaves_the_limits_is_clipped_and_counted():
    drive, q = Drive(Still()), np.tile(PANDA.q_home, (2, 1))
    q[0, 5] = PANDA.limits.q_max[5] - 0.01
    far = q + np.eye(7)[5] * [[0.1], [5.0]]
    action = drive.action([0, 1], observation(q), Step(far, np.ones(2)))
    assert [action.notes[e]["clipped"] for e in (0, 1)] == [1, 1]
    assert action.q[0][-1, 5] == pytest.approx(PANDA.limits.q_max[5])
    reach = 0.1 * PANDA.limits.velocity[5]
    assert action.q[1][-1, 5] == pytest.approx(q[1, 5] + reach, abs=1e-6)
    assert np.abs(np.diff(action.q[1], axis=0)).max() == pytest.approx(reach / 10)
    assert action.gripper[1].tolist() == [0] * 9 + [1]
    # From where the arms were sent, not from where they have got to.
    nowhere = Step(np.full((2, 7), np.nan), np.zeros(2))
    action = drive.action([1], observation(q), nowhere)
    assert action.q[1][-1, 5] == pytest.approx(q[1, 5] + reach, abs=1e-6)
    assert action.notes[1]["clipped"] == 1
    assert len(action.q[0]) == 0


# A policy of one's own


@dataclass(frozen=True)
class LineConfig(PolicyConfig):
    gain: float = 1.0


@dataclass(frozen=True, kw_only=True)
class LineTraining(PolicyTraining):
    name: str = "line"
    network: LineConfig = LineConfig(horizon=4, executed=2)


class Line(nn.Module):
    config: LineConfig

    @nn.compact
    def __call__(self, window) -> jax.Array:
        config = self.config
        x = nn.Dense(config.horizon * config.size)(config.gain * window.q[..., -1, :])
        return x.reshape(*x.shape[:-1], config.horizon, config.size)


def act(config, params, window, keys):
    return Line(config).apply(params, window)


def loss(config, params, key, batch):
    window, x_0 = examples(config, key, batch)
    said = Line(config.network).apply(params, window)
    return jnp.mean((said - x_0[:, -1]) ** 2), {}


POLICY = Policy("line", LineConfig, LineTraining, Line, act, loss)


@pytest.fixture
def line(monkeypatch, timed_demos, tmp_path):
    monkeypatch.setitem(POLICIES, "line", POLICY)
    monkeypatch.setattr(files, "RUNS", tmp_path)
    out = ["--data", timed_demos, "--steps", "20", "--out", str(tmp_path / "w")]
    assert train.main(["line", *out]) == 0
    return load_weights("line", tmp_path / "w")


def test_a_toy_policy_is_trained_saved_and_acts(line, mug_task):
    assert policies.policy_of(line.config) is POLICY
    assert len(line.config.action_low) == JOINTS
    assert line.info["tasks"] == ["mug"]
    agent = PolicyAgent(mug_task, line)
    agent.reset(range(4))
    mug_task.reset(range(4), range(4))
    seen = mug_task.observe(range(4))
    first = agent.act(0, [0, 1, 2, 3], seen)
    assert [len(q) for q in first.q] == [10] * 4
    for number in range(1, 5):
        agent.act(number, [0, 2], seen)
    assert agent.network._cache_size() == 1


def test_weights_of_others_are_refused(line, mug_task):
    """Of another camera, robot or task, before anything runs."""
    other = line._replace(info=line.info | {"cameras": ["static"]})
    with pytest.raises(WeightsError, match="camera static, not hand"):
        PolicyAgent(mug_task, other)
    with pytest.raises(WeightsError, match="no transformer in"):
        load_weights("transformer", files.RUNS / "w")


def test_demonstrations_of_the_other_kind_are_refused(
    demos, timed_demos, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(files, "RUNS", tmp_path)
    for kind, directory, flag in (
        ("lstm_gmm", demos, "with --timed"),
        ("predictor", timed_demos, "without --timed"),
    ):
        assert train.main([kind, "--data", directory]) == 2
        assert flag in capsys.readouterr().err
    assert train.main(["lstm", "--data", timed_demos]) == 2
    assert "lstm_gmm" in capsys.readouterr().err


def test_a_shard_of_whole_episodes_obeys_the_schema():
    shard = timed()
    assert data.schema.check_shard(shard) is shard
    with pytest.raises(data.DataError, match="action_gripper leaves"):
        data.schema.check_shard(shard._replace(action_gripper=shard.gripper + 2))


# Training


@pytest.fixture(scope="module")
def trained(timed_demos, tmp_path_factory):
    """All three, by the debug recipe."""
    root = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "RUNS", root / "runs")
        for kind in ("diffusion_policy", "lstm_gmm", "transformer"):
            out = ["--out", str(root / "weights")]
            assert train.main([*command(kind, timed_demos), *out]) == 0
    return root


def command(kind: str, demos: str) -> list[str]:
    return [kind, "--config", str(CONFIGS / "debug.py"), "--data", demos]


@pytest.mark.parametrize("kind", ["diffusion_policy", "lstm_gmm", "transformer"])
@pytest.mark.long
def test_a_killed_training_ends_with_the_same_bits(
    kind, trained, timed_demos, tmp_path, monkeypatch
):
    monkeypatch.setattr(files, "RUNS", tmp_path / "runs")
    rows = loop.rows_of_step

    def killed(config, given, step):
        if step == 14:
            raise KeyboardInterrupt
        return rows(config, given, step)

    arguments = [*command(kind, timed_demos), "--out", str(tmp_path)]
    with monkeypatch.context() as patch:
        patch.setattr(loop, "rows_of_step", killed)
        with pytest.raises(KeyboardInterrupt):
            train.main(arguments)
    assert train.main(arguments) == 0
    whole, cut = (load_weights(kind, d) for d in (trained / "weights", tmp_path))
    jax.tree.map(np.testing.assert_array_equal, whole.params, cut.params)
    snapshots = sorted((trained / "runs" / f"debug_{kind}" / "snapshots").iterdir())
    assert [path.name for path in snapshots] == ["000010", "000020"]
    last = load_weights(kind, snapshots[-1])
    jax.tree.map(np.testing.assert_array_equal, whole.params, last.params)


@pytest.mark.parametrize("kind", ["diffusion_policy", "lstm_gmm", "transformer"])
def test_what_a_lane_does_depends_on_it_alone(kind, trained):
    """Whoever runs beside it, and whichever of the lanes it is; nothing compiles twice."""
    task = Still()
    agent = PolicyAgent(task, load_weights(kind, trained / "weights"))
    rng = np.random.default_rng(0)
    images = rng.integers(0, 256, (2, *data.IMAGE_SHAPE), np.uint8)
    q = np.stack([PANDA.q_home, PANDA.q_home + 0.1]).astype(np.float32)
    seen = Observation({"hand": images}, q, np.array([0, 1], np.uint8))

    def said(seeds, order):
        agent.reset(seeds)
        shown = Observation({"hand": images[order]}, seen.q[order], seen.gripper[order])
        return agent.act(0, [0, 1], shown).q

    straight, swapped = said([7, 8], [0, 1]), said([8, 7], [1, 0])
    np.testing.assert_array_equal(straight[0], swapped[1])
    np.testing.assert_array_equal(straight[1], swapped[0])
    assert agent.network._cache_size() == 1


# Beginning with what the predictor sees


@pytest.fixture(scope="module")
def upper(tmp_path_factory):
    """A directory of a predictor of the debug recipe's sizes, untrained."""
    directory = tmp_path_factory.mktemp("upper")
    config = runpy.run_path(str(CONFIGS / "debug.py"))["predictor"].network
    frame = {"image": np.zeros((1, *data.IMAGE_SHAPE), np.uint8), "q": np.zeros((1, 7))}
    params = Predictor(config).init(jax.random.key(5), **frame, gripper=np.zeros(1))
    save_weights(directory, "predictor", params, config, {})
    return directory


@pytest.mark.parametrize("kind", ["diffusion_policy", "lstm_gmm", "transformer"])
def test_a_picture_and_what_the_encoder_says_of_it_teach_the_same(kind):
    policy, shard = POLICIES[kind], timed(episodes=2, frames=6)
    training = runpy.run_path(str(CONFIGS / "debug.py"))[kind]
    network = replace(training.network, camera=HandCameraConfig(), calibrates=True)
    network = fitted(network, shard)
    training = replace(training, network=network, augment=AugmentConfig(0, 0, 0))
    params = policies.init(network, jax.random.key(1))
    own = {"params": {"encoder": params["params"]["window"]["encoder"]}}
    said = encodings(network, own, shard.image)
    key, rows = jax.random.key(2), np.arange(12)
    values = [
        jax.jit(partial(policy.loss, training))(
            params, key, Windows(seen, network)(rows)
        )
        for seen in (shard, shard._replace(image=said))
    ]
    jax.tree.map(partial(np.testing.assert_allclose, rtol=1e-4), *values)


def test_kept_encodings_that_are_damaged_are_made_again(tmp_path, monkeypatch):
    """Any single bit: the archive says so, or the arrays are the same."""
    monkeypatch.setattr(files, "RUNS", tmp_path)
    rng, made = np.random.default_rng(0), []
    said = files.Encoding(*(rng.normal(size=(2, 3)) for _ in files.Encoding._fields))
    monkeypatch.setattr(files.predictor, "encodings", lambda *_: made.append(1) or said)
    weights = Weights(None, {}, {"sha256": "of the predictor"})
    ask = partial(files.encoded, weights, np.zeros(2), {"data": "of the data"})
    ask()
    (path,) = (tmp_path / "encodings").iterdir()
    whole = path.read_bytes()
    for _ in range(200):
        content = bytearray(whole)
        content[rng.integers(len(content))] ^= 1 << rng.integers(8)
        path.write_bytes(content)
        jax.tree.map(np.testing.assert_array_equal, ask(), said)
    assert len(made) > 100


def test_encoding_once_leaves_the_encoder_as_it_is(
    upper, timed_demos, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(files, "RUNS", tmp_path / "runs")
    kind, once = "lstm_gmm", ["--encode-once"]
    start = [*command("lstm_gmm", timed_demos), "--sight", str(upper)]
    assert train.main([*start, *once, "--out", str(tmp_path / "once")]) == 0
    theirs = load_weights("predictor", upper).params["params"]
    head = load_weights(kind, tmp_path / "once")
    window = head.params["params"]["window"]
    jax.tree.map(np.testing.assert_array_equal, window["encoder"], theirs["encoder"])
    assert not np.array_equal(window["Dense_0"]["kernel"], theirs["Dense_0"]["kernel"])
    assert set(head.info) >= {"sight_sha256"}
    # And on from there, the encoder with it.
    on = [*command(kind, timed_demos), "--name", "on", "--init", str(tmp_path / "once")]
    assert train.main([*on, "--out", str(tmp_path / "whole")]) == 0
    whole = load_weights(kind, tmp_path / "whole").params["params"]["window"]
    kernels = [w["encoder"]["keypoints"]["kernel"] for w in (window, whole)]
    assert not np.array_equal(*kernels)
    other = ["--network.state-features", "9", "--name", "other"]
    assert train.main([*start, *other]) == 2
    assert "other --network settings: Dense_0" in capsys.readouterr().err
    with pytest.raises(ValueError, match="encode_once: by which encoder"):
        LineTraining(encode_once=True)
    # What has left the encoder cannot go on with it; what has kept it can.
    for place, code in (("whole", 2), ("once", 0)):
        begun = [*start, *once, "--name", place, "--init", str(tmp_path / place)]
        assert train.main(begun) == code
        assert ("sees by another encoder" in capsys.readouterr().err) == (code == 2)

"""A second sampler family: one linear layer. One file, and a line in the registry."""

from dataclasses import dataclass

import flax.linen as nn
import jax
import jax.numpy as jnp

from jaxplan import samplers, train
from jaxplan.learning import SegmentTraining
from jaxplan.learning.sampler import examples
from jaxplan.networks import Cond, SegmentConfig
from jaxplan.pretrained import DIRECTORY, load_weights
from jaxplan.samplers import Bank, Family
from jaxplan.samplers.segments import noise, segments
from jaxplan.trainings import files


@dataclass(frozen=True)
class LineConfig(SegmentConfig):
    spread: float = 0.1


@dataclass(frozen=True, kw_only=True)
class LineTraining(SegmentTraining):
    name: str = "line"
    network: LineConfig = LineConfig(encoder=None)


class Line(nn.Module):
    config: LineConfig

    @nn.compact
    def __call__(self, cond: Cond) -> jax.Array:
        return nn.Dense(self.config.size)(jnp.concatenate([cond.q, cond.q_goal], -1))


def fresh(config, key, cond, training):
    return Line(config).init(key, cond)


def draw(config, params, cond, keys, n):
    mean = Line(config).apply(params, cond)[:, None]
    return segments(
        config, mean + config.spread * noise(config, keys, n, config.size), cond
    )


def loss(config, params, key, batch):
    cond, x_0 = examples(config, key, batch)
    return jnp.mean((Line(config.network).apply(params, cond) - x_0) ** 2), {}


FAMILY = Family("line", LineConfig, LineTraining, Line, fresh, draw, loss)


def test_it_is_trained_saved_and_drawn_from(monkeypatch, demos, tmp_path):
    monkeypatch.setitem(samplers.FAMILIES, "line", FAMILY)
    monkeypatch.setattr(files, "RUNS", tmp_path)
    monkeypatch.setattr(
        files, "encoded", lambda upper, image, _: (image[:, 0, 0] / 255, None)
    )
    out = ["--data", demos, "--steps", "20", "--out", str(tmp_path / "w")]
    assert train.main(["line", "--predictor", str(DIRECTORY), *out]) == 0
    weights = load_weights("line", tmp_path / "w")
    q = jnp.zeros((3, 7))
    cond = Cond(q, q, q[:, 0], q, q[:, 0], q)
    segment = Bank(weights, 5).of(cond, jax.random.split(jax.random.key(0), 3))(
        [0, 1, 2]
    )
    assert segment.direction.shape == (3, 5, 7)

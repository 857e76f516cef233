"""The data set's card says what its shards hold."""

import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "train"))

import card
from test_learning import demonstrations

from jaxplan import data

SETTINGS = {
    "task": "mug",
    "first_seed": 0,
    "camera": "hand",
    "demonstration": {"noisy_episodes": 0.5},
}


@pytest.fixture
def collection(tmp_path):
    shard = demonstrations(episodes=8, frames=4)
    success = np.arange(8) != 3
    shard = shard._replace(
        episode_success=success,
        episode_failure=np.where(success, "", "the mug is outside the box"),
    )
    data.write_shard(data.shard_path(tmp_path, 0), shard)
    data.write_manifest(tmp_path, SETTINGS)
    return tmp_path, shard


def test_parts_of_a_card_add_up(collection):
    _, shard = collection
    described = card.describe(shard, SETTINGS)
    assert described["episodes"] == 8
    assert described["succeeded"] == 7
    assert described["failures"] == {"the mug is outside the box": 1}
    assert sum(described["frames_by_toggle"].values()) == len(shard.q)
    for parts in described["success_by_start"].values():
        solved, made = zip(
            *(map(int, p.split("/")) for p in parts.values()), strict=True
        )
        assert (sum(solved), sum(made)) == (7, 8)


def test_a_card_is_for_people_too(collection):
    directory, _ = collection
    card.write_card(directory)
    text = (directory / "CARD.md").read_text()
    assert "8 episodes from seed 0, of which the expert solved 7; 32 frames" in text
    assert "| the mug is outside the box | 1 |" in text


def test_a_card_counts_the_ways_that_episodes_took(collection, monkeypatch):
    _, shard = collection
    ways = SimpleNamespace(zones={"left", "right"}, way=lambda q: str(q[0, 0]))
    monkeypatch.setattr(card.tasks, "load", lambda *_: ways)
    toggle = np.where(shard.seed < 6, 3, 2).astype(
        np.int8
    )  # the others' ways count not
    q = shard.path_q.copy()
    q[shard.path, 0, 0] = shard.seed % 4
    described = card.describe(shard._replace(path_q=q, toggle=toggle), SETTINGS)
    seeds = np.unique(shard.seed[toggle == 3])
    assert len(seeds) == 6
    assert described["ways"] == Counter(str(float(seed % 4)) for seed in seeds)

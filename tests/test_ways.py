"""The variant `ways`: either side of the post is a way, and an episode may close one."""

from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan.collision import certify, clearance
from jaxplan.demonstrations import ExpertAgent
from jaxplan.demonstrations.expert import CLEAN
from jaxplan.episodes import run_episodes
from jaxplan.evaluation.certification import Certification
from jaxplan.tasks.mug.task import MugTask
from jaxplan.tasks.mug.ways import OPEN, WAYS, closed_way, way_of

SEEDS = [seed for seed in range(100) if closed_way(seed, WAYS.zones)][:4]
"""Of episodes that close a way."""


@pytest.fixture(scope="module")
def episodes():
    """The expert's, with the way past the post that each took, by seed."""
    task = MugTask(len(SEEDS), variant="ways")
    expert = ExpertAgent(task, CLEAN)
    certification = Certification(expert.planner, task.planning_scene)
    taken: dict[int, list[str]] = {seed: [] for seed in SEEDS}
    worlds = {}

    def listen(phase):
        for e in phase.lanes:
            q = phase.action.q[e]
            way = task.way(q)
            if way is not None:
                taken[SEEDS[e]].append(way)
                leaf = jax.tree.map(lambda x, e=e: x[e], phase.action.decision.worlds)
                worlds[SEEDS[e]] = leaf, q

    records = run_episodes(task, expert, SEEDS, listeners=[certification, listen])
    return task, records, taken, worlds, certification


def test_the_expert_goes_by_the_way_that_is_left(episodes):
    _, records, taken, _, certification = episodes
    assert [record.failure for record in records] == [None] * len(SEEDS)
    assert certification.refused == []
    assert certification.invalid == []
    for seed in SEEDS:
        assert taken[seed], "no motion passed the post"
        assert closed_way(seed, WAYS.zones) not in taken[seed]
    assert {way for ways in taken.values() for way in ways} == set(WAYS.zones)


def test_hand_and_mug_keep_out_of_a_zone_and_links_need_not(episodes):
    """Each path is free in its episode's world, and hits the zone that closes its own way."""
    task, _, _, worlds, _ = episodes
    scene = task.planning_scene
    checked = {name for group, *_ in scene.pairs for name in group.split("|")}
    assert {"hand", "left_finger", "right_finger", "mug"} <= {
        name
        for group, *_ in scene.pairs
        if "obstacles" in group.split("|")
        for name in group.split("|")
    }
    assert "obstacles" in checked
    assert not any("link" in g and "obstacles" in g for g, *_ in scene.pairs)
    for seed, (world, q) in worlds.items():
        assert certify(scene, world, q).valid
        other = next(z for n, z in WAYS.zones.items() if n != _closed(seed))
        moved = world._replace(
            slot_pose=world.slot_pose.at[0, :3].set(other.middle),
            slot_size=world.slot_size.at[0].set(other.half),
        )
        assert float(clearance(scene, moved, jnp.asarray(q, jnp.float32)).min()) < 0


def test_no_camera_sees_a_zone(monkeypatch):
    """Bit for bit the picture is the same whichever way is closed; the planner's world is not."""
    pictures, worlds = [], []
    task = MugTask(1, variant="ways")
    for closed in (None, *WAYS.zones):
        monkeypatch.setattr("jaxplan.tasks.mug.task.closed_way", lambda *_, c=closed: c)
        task.reset([0], [0])
        pictures.append(task.observe([0]).images["hand"])
        worlds.append(np.asarray(task.worlds(np.zeros(1, bool)).slot_pose))
    assert len({picture.tobytes() for picture in pictures}) == 1
    assert len({world.tobytes() for world in worlds}) == len(worlds)


def test_ways_are_closed_by_seed_and_evenly():
    count = 4000
    drawn = Counter(closed_way(seed, WAYS.zones) for seed in range(count))
    again = Counter(closed_way(seed, WAYS.zones) for seed in range(count))
    assert drawn == again
    assert drawn[None] / count == pytest.approx(OPEN, abs=0.03)
    for name in WAYS.zones:
        assert drawn[name] / count == pytest.approx((1 - OPEN) / 2, abs=0.03)
    assert closed_way(3, ()) is None


@pytest.mark.parametrize(
    ("x", "expected"), [((0.3, 0.3), "inside"), ((0.7, 0.7), "outside"), ((), None)]
)
def test_a_way_is_told_from_where_the_hand_passes(x, expected):
    places = [
        [0.45, 0.0, 0.2],
        *([each, y, 0.2] for each, y in zip(x, (-0.1, -0.3), strict=False)),
    ]
    assert way_of(np.array(places)) == expected


def _closed(seed):
    return closed_way(seed, WAYS.zones)

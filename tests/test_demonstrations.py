"""What the expert's episodes leave behind: frames, clean labels, paths."""

import numpy as np
import pytest

from jaxplan.data import NO_PATH, read_shard, write_shard
from jaxplan.data.schema import check_shard
from jaxplan.robots import PANDA
from jaxplan.tasks.mug.expert import Expert, Toggle


@pytest.fixture(scope="module")
def shard(demonstration):
    return demonstration.recorder.shard(demonstration.records)


def test_a_shard_obeys_the_schema(shard):
    assert check_shard(shard) is shard
    assert set(shard.seed) == set(range(4))
    assert set(shard.toggle) == {int(toggle) for toggle in Toggle}
    assert shard.episode_success.all()
    assert np.bincount(shard.seed).max() <= 40, "a few views of a phase, not a film"


def test_same_seeds_give_the_same_bytes(shard, demonstration, demonstrate, tmp_path):
    again = demonstrate(demonstration.seeds)
    write_shard(tmp_path / "a.npz", shard)
    write_shard(tmp_path / "b.npz", again.recorder.shard(again.records))
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    for column, read in zip(shard, read_shard(tmp_path / "a.npz"), strict=True):
        np.testing.assert_array_equal(column, read)


def test_labels_are_clean_keyframes(shard, demonstration, mug_task):
    """Also in episodes that were driven with noise: the expert's own, from the settled mug."""
    mug_task.reset(range(4), demonstration.seeds)
    expert = Expert(mug_task.kinematics)
    for e, seed in enumerate(demonstration.seeds):
        keyframes = expert.keyframes(
            mug_task.object_pose(e), PANDA.q_home, closed=False
        ).q
        frames = (shard.seed == seed) & (shard.toggle == Toggle.GRASP1)
        assert np.ptp(shard.q_toggle[frames], axis=0).max() == 0
        np.testing.assert_allclose(shard.q_toggle[frames][0], keyframes[-1], atol=1e-6)
        for q_goal in shard.q_goal[frames]:
            assert np.abs(keyframes - q_goal).max(axis=1).min() < 1e-6


def test_some_episodes_were_driven_beside_their_labels(demonstration, shard):
    driven = {
        record.seed: np.array([phase["subgoal"] for phase in record.phases], np.float32)
        for record in demonstration.records
    }
    clean = {
        seed: all(np.any(np.all(q == shard.q_goal, axis=1)) for q in goals[:3])
        for seed, goals in driven.items()
    }
    assert set(clean.values()) == {True, False}


def test_a_toggle_has_one_label(shard):
    for seed in set(shard.seed):
        for toggle in Toggle:
            frames = (shard.seed == seed) & (shard.toggle == toggle)
            assert np.ptp(shard.q_toggle[frames], axis=0).max() == 0
            assert set(shard.gripper_toggle[frames]) == {1 - toggle % 2}
            assert set(shard.gripper[frames]) == {toggle % 2}


def test_paths_lead_from_the_frame_to_its_subgoal(shard):
    assert (shard.path != NO_PATH).all()
    path = shard.path_q[shard.path]
    np.testing.assert_allclose(path[:, 0], shard.q, atol=1e-5)
    np.testing.assert_allclose(path[:, -1], shard.q_goal, atol=1e-6)
    steps = np.linalg.norm(np.diff(path, axis=1), axis=2)
    length = shard.path_length[shard.path]
    assert np.all(steps.sum(axis=1) <= length * (1 + 1e-4))
    assert np.all(length >= np.linalg.norm(shard.q_goal - shard.q, axis=1) - 1e-5)


def test_a_failed_episode_leaves_only_its_record(demonstration, shard):
    records = list(demonstration.records)
    records[1] = records[1]._replace(success=False, failure="dropped")
    fewer = demonstration.recorder.shard(records)
    assert set(fewer.seed) == {0, 2, 3}
    assert len(fewer.path_q) == len(fewer.path) < len(shard.path)
    assert fewer.episode_seed.tolist() == [0, 1, 2, 3]
    assert fewer.episode_failure.tolist() == ["", "dropped", "", ""]


def test_every_frame_is_a_view_of_its_own(shard):
    views = shard.image.reshape(len(shard.image), -1)
    assert len(np.unique(views, axis=0)) == len(views)

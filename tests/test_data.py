"""Shards: what is written is read back, and nothing damaged is read at all."""

import numpy as np
import pytest

from jaxplan import data


def make_shard(seed: int = 0, frames: int = 6, paths: int = 2) -> data.Shard:
    rng = np.random.default_rng(seed)
    return data.as_shard(
        image=rng.integers(0, 256, (frames, *data.IMAGE_SHAPE)),
        q=rng.normal(size=(frames, 7)),
        gripper=rng.integers(0, 2, frames),
        q_toggle=rng.normal(size=(frames, 7)),
        gripper_toggle=rng.integers(0, 2, frames),
        q_goal=rng.normal(size=(frames, 7)),
        toggle=rng.integers(0, 4, frames),
        camera_error=np.zeros((frames, 5)),
        seed=np.full(frames, seed),
        path=rng.integers(-1, paths, frames),
        arc=rng.uniform(size=frames),
        path_q=rng.normal(size=(paths, 64, 7)),
        path_length=rng.uniform(size=paths),
        episode_seed=[seed],
        episode_success=[True],
        episode_failure=["" if seed else "dropped"],
    )


def collect(directory, shards: int = 2) -> None:
    for index in range(shards):
        data.write_shard(data.shard_path(directory, index), make_shard(index))
    data.write_manifest(directory, {"seeds": [0, shards]})


def test_round_trip_and_same_bytes(tmp_path):
    shard = make_shard()
    for name in ("a.npz", "b.npz"):
        data.write_shard(tmp_path / name, shard)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    for written, read in zip(shard, data.read_shard(tmp_path / "a.npz"), strict=True):
        np.testing.assert_array_equal(written, read)


def test_empty_shard_round_trip(tmp_path):
    data.write_shard(tmp_path / "a.npz", make_shard(frames=0, paths=0))
    assert data.read_shard(tmp_path / "a.npz").image.shape == (0, *data.IMAGE_SHAPE)


def test_concatenation_keeps_each_frame_on_its_path(tmp_path):
    collect(tmp_path)
    whole = data.read_demonstrations(tmp_path)
    for index in range(2):
        part = make_shard(index)
        rows = np.flatnonzero(whole.seed == index)
        on = part.path != data.NO_PATH
        np.testing.assert_array_equal(whole.path[rows] == data.NO_PATH, ~on)
        np.testing.assert_array_equal(
            whole.path_q[whole.path[rows][on]], part.path_q[part.path[on]]
        )


@pytest.mark.parametrize("where", [0.1, 0.5, 0.9, 0.999])
def test_flipped_bit_is_detected(tmp_path, where):
    collect(tmp_path)
    path = data.shard_path(tmp_path, 1)
    content = bytearray(path.read_bytes())
    content[int(where * len(content))] ^= 4
    path.write_bytes(content)
    with pytest.raises(data.DataError, match="shard_00001"):
        data.read_demonstrations(tmp_path)
    assert data.missing_shards(tmp_path, 3, {"seeds": [0, 2]}) == [1, 2]


def test_missing_things_are_named(tmp_path):
    with pytest.raises(data.DataError, match="no such data directory"):
        data.read_demonstrations(tmp_path / "none")
    with pytest.raises(data.DataError, match=r"no manifest\.json"):
        data.read_demonstrations(tmp_path)
    collect(tmp_path)
    data.shard_path(tmp_path, 0).unlink()
    with pytest.raises(data.DataError, match="missing shard"):
        data.read_demonstrations(tmp_path)


def test_other_settings_are_refused(tmp_path):
    collect(tmp_path)
    with pytest.raises(data.DataError, match="was made with settings"):
        data.missing_shards(tmp_path, 2, {"seeds": [0, 9]})


def test_resume_before_the_final_manifest(tmp_path):
    data.write_manifest(tmp_path, {"n": 1})
    data.write_shard(data.shard_path(tmp_path, 1), make_shard())
    data.shard_path(tmp_path, 2).write_bytes(b"PK half a file")
    assert data.missing_shards(tmp_path, 3, {"n": 1}) == [0, 2]


def test_bad_columns_are_named():
    good = make_shard()
    with pytest.raises(data.DataError, match="q holds"):
        data.schema.check_shard(good._replace(q=np.full_like(good.q, np.nan)))
    with pytest.raises(data.DataError, match="path leaves"):
        data.schema.check_shard(good._replace(path=good.path + 5))
    with pytest.raises(data.DataError, match="image is"):
        data.schema.check_shard(good._replace(image=good.image[:, :4]))

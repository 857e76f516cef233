"""Timed demonstrations: what is kept of an episode, and that it does the same once more."""

import numpy as np
import pytest

from jaxplan.data import FRAME_PERIOD
from jaxplan.demonstrations import ExpertAgent, TimedRecorder
from jaxplan.demonstrations.timed import TICKS, actions
from jaxplan.episodes import EpisodeConfig, run_episodes
from jaxplan.policies import Replay
from jaxplan.simulation.physics import CONTROL_PERIOD

SEEDS = range(4)


@pytest.fixture(scope="module")
def shard(mug_task, mug_planner):
    expert = ExpertAgent(mug_task, planner=mug_planner)
    recorder = TimedRecorder(mug_task, expert, SEEDS)
    records = run_episodes(mug_task, expert, SEEDS, listeners=[recorder])
    assert mug_task.sim.record is not None
    made = recorder.shard(records)
    assert mug_task.sim.record is None
    return made


@pytest.mark.parametrize(
    ("length", "toggles", "expected"),
    [
        (28, False, [9, 19, 27]),
        (30, False, [9, 19, 29]),
        (31, True, [9, 19, 29, 30, 30]),
        (1, True, [0]),
    ],
)
def test_actions_of_a_motion(length, toggles, expected):
    """Where the arm is commanded to be a period later; at the toggle it has arrived."""
    q, mode = np.arange(length)[:, None] * np.ones(7), np.zeros(length, np.uint8)
    mode[-1] = toggles
    frames = actions(q, mode)
    assert [at[0] for at, _ in frames] == expected
    modes = [gripper for _, gripper in frames]
    assert modes == [0] * (len(expected) - toggles) + [1] * toggles
    assert pytest.approx(FRAME_PERIOD) == TICKS * CONTROL_PERIOD


def test_episodes_are_whole_and_in_order(shard):
    assert shard.seed.tolist() == sorted(shard.seed)
    assert set(shard.seed) == {*SEEDS}
    for seed in SEEDS:
        rows = shard.seed == seed
        toggles = (shard.gripper != shard.action_gripper)[rows]
        assert shard.action_gripper[rows][toggles].tolist() == [1, 0, 1, 0]
        assert toggles[-1], "what comes after the last release nobody has to learn"
        assert 80 < rows.sum() < 250
        assert shard.toggle[rows].tolist() == sorted(shard.toggle[rows])


def test_an_action_is_where_the_arm_is_a_period_later(shard):
    same = np.diff(shard.seed) == 0
    moving = shard.gripper == shard.action_gripper
    off = np.abs(shard.q[1:] - shard.action_q[:-1]).max(1)[same & moving[:-1]]
    assert np.quantile(off, 0.95) < 0.01
    at_rest = ~moving
    assert np.abs(shard.q - shard.action_q)[at_rest].max() < 0.02


def test_every_frame_has_a_picture_of_its_own(shard, mug_task):
    views = shard.image.reshape(len(shard.image), -1)
    assert len(np.unique(views, axis=0)) > 0.95 * len(views)
    mug_task.reset(SEEDS, SEEDS)
    first = mug_task.observe(SEEDS).images["hand"][2]
    at = np.flatnonzero(shard.seed == 2)[0]
    np.testing.assert_array_equal(shard.image[at], first)


def test_recorded_actions_do_the_same_once_more(shard, mug_task):
    """Through the interface of policies, with the judge of all agents."""
    config = EpisodeConfig(max_phases=300, max_stuck=50)
    records = run_episodes(mug_task, Replay(mug_task, shard), SEEDS, config)
    assert all(record.success for record in records)
    assert sum(p["clipped"] for record in records for p in record.phases) == 0
    for record in records:
        assert sum(phase["toggled"] for phase in record.phases) == 4

"""The outer loop with the expert in the place of the networks, and with bad predictors."""

import numpy as np

from jaxplan.config import RolloutConfig
from jaxplan.rollout import Targets, rollout
from jaxplan.tasks.mug import poses
from jaxplan.tasks.mug.demonstrate import ExpertPolicy
from jaxplan.tasks.mug.scene import Q_HOME
from jaxplan.tasks.mug.task import MugTask


def stay(observation, episodes):
    """A predictor that always says q_curr, and the gripper's present mode."""
    return Targets(observation.q, observation.gripper, observation.q)


def without_time(record):
    return record._replace(
        phases=[phase._replace(planning_seconds=0.0) for phase in record.phases]
    )


def test_the_expert_puts_every_mug_in_the_box(demonstration):
    assert [record.failure for record in demonstration.records] == [None] * 4
    assert [record.seed for record in demonstration.records] == [0, 1, 2, 3]


def test_every_episode_toggles_four_times_in_order(demonstration):
    for record in demonstration.records:
        toggles = [phase.gripper_toggle for phase in record.phases if phase.toggled]
        assert toggles == [1, 0, 1, 0]


def test_records_tell_each_phase(demonstration):
    for record in demonstration.records:
        assert 12 <= len(record.phases) <= 16
        for phase in record.phases:
            assert phase.status == "SOLVED"
            assert phase.expansions >= 1
            assert phase.planning_seconds > 0
            assert phase.smoothing in ("LINE", "SPLINE", "DENSER", "POLYLINE")
            assert not phase.toggled or phase.subgoal == phase.q_toggle
        for before, after in zip(record.phases, record.phases[1:], strict=False):
            np.testing.assert_allclose(after.q_start, before.subgoal, atol=0.02)
        assert record.expansions == sum(phase.expansions for phase in record.phases)


def test_what_is_executed_is_certified_by_mujoco(demonstration):
    assert demonstration.certification.refused == []
    assert demonstration.certification.invalid == []


def test_an_episode_does_not_depend_on_its_neighbours(demonstration, demonstrate):
    """Alone in another lane it goes as before, to the last bit."""
    alone = demonstrate(range(2, 3)).records[0]
    assert without_time(alone) == without_time(demonstration.records[2])


def test_without_friction_every_episode_fails(mug_planner):
    task = MugTask(4, friction=0.0)
    policy = ExpertPolicy(task)
    policy.reset(range(4))
    records = rollout(task, range(4), lambda o, e: Targets(*policy(o, e)), mug_planner)
    assert not any(record.success for record in records)
    assert all(record.failure for record in records)


def test_standing_still_ends_with_a_reason(mug_task, mug_planner):
    config = RolloutConfig(max_phases=5)
    records = rollout(mug_task, range(4), stay, mug_planner, config=config)
    for record in records:
        assert record.failure == "no motion in phase 2: the subgoal is where the arm is"
        assert len(record.phases) == 2
        assert not any(phase.toggled for phase in record.phases)


def test_a_goal_that_cannot_be_reached_ends_with_a_reason(mug_task, mug_planner):
    below_the_table = np.array([0.0, 1.6, 0.0, -0.5, 0.0, 2.0, 0.0])

    def predict(observation, episodes):
        q = np.tile(below_the_table, (len(episodes), 1))
        return Targets(q, 1 - observation.gripper, q)

    record = rollout(mug_task, [0], predict, mug_planner)[0]
    assert "no motion in phase 2: GOAL_IN_COLLISION" in (record.failure or "")
    assert "table" in (record.failure or "")
    assert [phase.smoothing for phase in record.phases] == ["NONE"] * 2


def test_toggling_on_the_spot_ends_with_a_reason(mug_task, mug_planner):
    def toggle(observation, episodes):
        return Targets(observation.q, 1 - observation.gripper, observation.q)

    config = RolloutConfig(max_phases=3)
    records = rollout(mug_task, range(2), toggle, mug_planner, config=config)
    for record in records:
        assert record.failure == "not finished after 3 phases"
        assert [phase.toggled for phase in record.phases] == [True] * 3


def test_a_gripper_that_closed_on_nothing_opens_and_backs_off(mug_task, mug_planner):
    """And one that holds the mug does not: what tells them apart is how far the fingers met."""

    def close(observation, episodes):
        return Targets(observation.q, np.ones(len(episodes), int), observation.q)

    config = RolloutConfig(max_phases=2, regrasp=True)
    record = rollout(mug_task, [0], close, mug_planner, config=config)[0]
    assert [phase.gripper_toggle for phase in record.phases] == [1, 0]
    assert [phase.toggled for phase in record.phases] == [True, False]
    assert not mug_task.closed[0]
    high, low = (mug_task.sim.data[e].site("tcp").xpos[2] for e in (0, 1))
    assert high - low > 0.09  # it looks down, so it backed off upwards

    policy = ExpertPolicy(mug_task)
    policy.reset(range(4))
    records = rollout(
        mug_task,
        range(4),
        lambda o, e: Targets(*policy(o, e)),
        mug_planner,
        config=RolloutConfig(regrasp=True),
    )
    assert all(record.success for record in records)
    for record in records:
        toggles = [phase.gripper_toggle for phase in record.phases if phase.toggled]
        assert toggles == [1, 0, 1, 0]


def test_a_mug_outside_the_range_is_a_failure(mug_task, mug_planner, monkeypatch):
    inside = poses.sample_pose

    def sometimes_far(seed, shape):
        position, rotation = inside(seed, shape)
        return position + np.array([0.0, 0.1 if seed == 1 else 0.0, 0.0]), rotation

    monkeypatch.setattr(poses, "sample_pose", sometimes_far)
    asked = []

    def predict(observation, episodes):
        asked.extend(episodes)
        return stay(observation, episodes)

    config = RolloutConfig(max_phases=2)
    records = rollout(mug_task, [0, 1, 2], predict, mug_planner, config=config)
    assert "outside the range" in (records[1].failure or "")
    assert records[1].phases == []
    assert set(asked) == {0, 2}
    assert all("no motion" in (records[e].failure or "") for e in (0, 2))


def test_a_prediction_that_is_not_finite_moves_nothing(mug_task, mug_planner):
    def predict(observation, episodes):
        q = np.full_like(observation.q, np.nan)
        return Targets(q, observation.gripper, q)

    record = rollout(mug_task, [0], predict, mug_planner)[0]
    assert "no motion in phase 2: INVALID_INPUT" in (record.failure or "")
    np.testing.assert_allclose(mug_task.sim.q(0), Q_HOME, atol=0.01)

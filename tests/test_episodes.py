"""Episodes of Algorithm 1 with the expert in the networks' place, and with bad predictors."""

import jax
import numpy as np

from jaxplan.algorithm1 import Algorithm1, Algorithm1Config
from jaxplan.base import Subgoal
from jaxplan.demonstrations import ExpertAgent
from jaxplan.episodes import EpisodeConfig, run_episodes
from jaxplan.planning import Status
from jaxplan.robots import PANDA
from jaxplan.tasks.mug import poses
from jaxplan.tasks.mug.task import MugTask


def stay(observation, episodes):
    """A predictor that always says q_curr, and the gripper's present mode."""
    return Subgoal(observation.q, observation.gripper, observation.q)


def run(task, planner, predict, seeds, max_phases=24, **settings):
    """Episodes of Algorithm 1 with a predictor that has no features."""
    agent = Algorithm1(
        task,
        planner,
        lambda observation, lanes: (predict(observation, lanes), None),
        config=Algorithm1Config(**settings),
    )
    return run_episodes(task, agent, seeds, EpisodeConfig(max_phases=max_phases))


def without_time(record):
    phases = [phase | {"planning_seconds": 0.0} for phase in record.phases]
    return record._replace(phases=phases)


def test_the_expert_puts_every_mug_in_the_box(demonstration):
    assert [record.failure for record in demonstration.records] == [None] * 4
    assert [record.seed for record in demonstration.records] == [0, 1, 2, 3]


def test_every_episode_toggles_four_times_in_order(demonstration):
    for record in demonstration.records:
        toggles = [
            phase["gripper_toggle"] for phase in record.phases if phase["toggled"]
        ]
        assert toggles == [1, 0, 1, 0]


def test_records_tell_each_phase(demonstration):
    for record in demonstration.records:
        assert 12 <= len(record.phases) <= 16
        for phase in record.phases:
            assert phase["status"] == "SOLVED"
            assert phase["expansions"] >= 1
            assert phase["planning_seconds"] > 0
            assert phase["smoothing"] in ("LINE", "SPLINE", "DENSER", "POLYLINE")
            assert not phase["toggled"] or phase["subgoal"] == phase["q_toggle"]
        for before, after in zip(record.phases, record.phases[1:], strict=False):
            np.testing.assert_allclose(after["q_start"], before["subgoal"], atol=0.02)
        assert record.expansions == sum(phase["expansions"] for phase in record.phases)


def test_what_is_executed_is_certified_by_mujoco(demonstration):
    assert demonstration.certification.refused == []
    assert demonstration.certification.invalid == []


def test_an_episode_does_not_depend_on_its_neighbours(demonstration, demonstrate):
    """Alone in another lane it goes as before, to the last bit."""
    alone = demonstrate(range(2, 3)).records[0]
    assert without_time(alone) == without_time(demonstration.records[2])


def test_without_friction_every_episode_fails(mug_planner):
    task = MugTask(4, friction=0.0)
    records = run_episodes(task, ExpertAgent(task, planner=mug_planner), range(4))
    assert not any(record.success for record in records)
    assert all(record.failure for record in records)


def test_standing_still_ends_with_a_reason(mug_task, mug_planner):
    records = run(mug_task, mug_planner, stay, range(4), max_phases=5)
    for record in records:
        assert record.failure == "no motion in phase 2: the subgoal is where the arm is"
        assert len(record.phases) == 2
        assert not any(phase["toggled"] for phase in record.phases)


def test_a_goal_that_cannot_be_reached_ends_with_a_reason(mug_task, mug_planner):
    below_the_table = np.array([0.0, 1.6, 0.0, -0.5, 0.0, 2.0, 0.0])

    def predict(observation, episodes):
        q = np.tile(below_the_table, (len(observation.q), 1))
        return Subgoal(q, 1 - observation.gripper, q)

    record = run(mug_task, mug_planner, predict, [0])[0]
    assert "no motion in phase 2: GOAL_IN_COLLISION" in (record.failure or "")
    assert "table" in (record.failure or "")
    assert [phase["smoothing"] for phase in record.phases] == ["NONE"] * 2


def test_toggling_on_the_spot_ends_with_a_reason(mug_task, mug_planner):
    def toggle(observation, episodes):
        return Subgoal(observation.q, 1 - observation.gripper, observation.q)

    records = run(mug_task, mug_planner, toggle, range(2), max_phases=3)
    for record in records:
        assert record.failure == "not finished after 3 phases"
        assert [phase["toggled"] for phase in record.phases] == [True] * 3


def test_a_subgoal_beside_the_toggle_is_the_toggle(mug_task, mug_planner):
    """Section 4.2: within 0.1 rad the motion goes to the toggle itself, and toggles there."""
    mug_task.reset(range(4), range(4))
    toggle = PANDA.q_home + np.array([0.1, 0.1, 0, 0, 0, 0, 0])
    off = np.zeros((4, 7))
    off[:, 3] = 0.0, 0.09, 0.11, -0.09

    def predict(observation, lanes):
        q_toggle = np.tile(toggle, (4, 1))
        return Subgoal(q_toggle, 1 - observation.gripper, q_toggle + off), None

    agent = Algorithm1(mug_task, mug_planner, predict)
    agent.reset(range(4))
    lanes = list(range(4))
    action = agent.act(0, lanes, mug_task.observe(lanes))
    merged = np.array([True, True, False, True])
    assert action.decision.at_toggle.tolist() == merged.tolist()
    for lane, way in enumerate(action.q):
        ends = toggle + (0 if merged[lane] else off[lane])
        np.testing.assert_allclose(way[-1], ends, atol=1e-3)
        assert action.gripper[lane][-1] == merged[lane]
        assert not action.gripper[lane][:-1].any()


class GivesUp:
    """A planner whose first searches come to nothing, in each lane so many."""

    def __init__(self, planner, times):
        self.limits, self._planner, self._times = planner.limits, planner, times
        self.asked, self.found = [], []

    def plan(self, *arguments, active, keys, **given):
        motion = self._planner.plan(*arguments, active=active, keys=keys, **given)
        over = active & (np.array(self._times) > len(self.asked))
        status = np.where(over, Status.BUDGET_EXHAUSTED, motion.result.status)
        self.asked.append((active.copy(), jax.random.key_data(keys)))
        self.found.append(motion.result.expansions)
        return motion._replace(result=motion.result._replace(status=status))


def test_a_search_that_gave_up_is_followed_by_another(mug_task, mug_planner):
    """Only where it did, with other random numbers, `tries` in all; costs add up."""
    mug_task.reset(range(4), range(4))
    goal = np.tile(PANDA.q_home + np.array([0.3, 0, 0, 0, 0, 0, 0]), (4, 1))
    planner = GivesUp(mug_planner, [0, 1, 2, 9])
    agent = Algorithm1(
        mug_task,
        planner,
        lambda observation, lanes: (Subgoal(goal, observation.gripper, goal), None),
        config=Algorithm1Config(tries=3),
    )
    agent.reset(range(4))
    action = agent.act(0, [0, 1, 2, 3], mug_task.observe([0, 1, 2, 3]))
    active, keys = zip(*planner.asked, strict=True)
    np.testing.assert_array_equal(active, [[1, 1, 1, 1], [0, 1, 1, 1], [0, 0, 1, 1]])
    assert len(np.unique(np.concatenate(keys), axis=0)) == 12
    result = action.decision.motion.result
    solved, over = Status.SOLVED, Status.BUDGET_EXHAUSTED
    assert result.status.tolist() == [solved, solved, solved, over]
    counted = np.sum(np.array(planner.found) * np.array(active), axis=0)
    np.testing.assert_array_equal(result.expansions, counted)
    for way in action.q:
        np.testing.assert_allclose(way[-1], goal[0], atol=1e-3)


def test_a_gripper_that_closed_on_nothing_opens_and_backs_off(mug_task, mug_planner):
    """And one that holds the mug does not: what tells them apart is how far the fingers met."""

    def close(observation, episodes):
        return Subgoal(observation.q, np.ones(len(observation.q), int), observation.q)

    record = run(mug_task, mug_planner, close, [0], max_phases=3, regrasp=True)[0]
    assert [phase["gripper_toggle"] for phase in record.phases] == [1, 0, 0]
    assert [phase["toggled"] for phase in record.phases] == [True, True, False]
    assert not mug_task.closed[0]
    high, low = (mug_task.sim.data[e].site("tcp").xpos[2] for e in (0, 1))
    assert high - low > 0.09  # it looks down, so it backed off upwards

    expert = ExpertAgent(mug_task, planner=mug_planner)
    expert.reset(range(4))
    agent = Algorithm1(
        mug_task, mug_planner, expert.predict, config=Algorithm1Config(regrasp=True)
    )
    records = run_episodes(mug_task, agent, range(4))
    assert all(record.success for record in records)
    for record in records:
        toggles = [
            phase["gripper_toggle"] for phase in record.phases if phase["toggled"]
        ]
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

    records = run(mug_task, mug_planner, predict, [0, 1, 2], max_phases=2)
    assert "outside the range" in (records[1].failure or "")
    assert records[1].phases == []
    assert set(asked) == {0, 2}
    assert all("no motion" in (records[e].failure or "") for e in (0, 2))


def test_a_prediction_that_is_not_finite_moves_nothing(mug_task, mug_planner):
    def predict(observation, episodes):
        q = np.full_like(observation.q, np.nan)
        return Subgoal(q, observation.gripper, q)

    record = run(mug_task, mug_planner, predict, [0])[0]
    assert "no motion in phase 2: INVALID_INPUT" in (record.failure or "")
    np.testing.assert_allclose(mug_task.sim.q(0), PANDA.q_home, atol=0.01)

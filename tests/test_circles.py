"""Joints that come round, rails of any length, walls thinner than a step."""

import numpy as np
import pytest

from jaxplan import Planner, PlannerConfig, Scene, Status

ARM = """<mujoco><compiler angle="radian"/><worldbody>
  <geom name="post" type="box" size=".05 .05 .3" pos="{post} 0 0"/>
  <body><joint name="turn" axis="0 0 1"/>
    <geom type="capsule" size=".03" fromto=".1 0 0 .5 0 0"/>
    <body pos=".5 0 0"><joint name="wrist" axis="0 0 1" range="-2 2"/>
      <geom type="sphere" size=".03" pos=".2 0 0"/></body></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def free() -> Planner:
    return Planner(Scene.from_mjcf(ARM.format(post=-2)))


@pytest.fixture(scope="module")
def blocked() -> Planner:
    return Planner(Scene.from_mjcf(ARM.format(post=0.4)))


def assert_is_a_way(planner, plan, start, goal):
    """From start to goal, or some turns from it, the short way at every step."""
    assert plan.solved, plan.reason
    np.testing.assert_allclose(plan.path[0], start, atol=1e-4)
    turns = (plan.path[-1] - goal) / (2 * np.pi)
    np.testing.assert_allclose(turns, [np.round(turns[0]), 0], atol=1e-4)
    assert np.all(np.abs(np.diff(plan.path[:, 0])) <= np.pi + 1e-5)
    assert planner.certify(plan).valid
    motion = planner.time(plan)
    assert motion.free
    assert planner.certify(motion.q).valid
    np.testing.assert_allclose(motion.q[0], plan.path[0], atol=1e-5)
    turns = (motion.q[-1] - goal) / (2 * np.pi)
    np.testing.assert_allclose(turns, [np.round(turns[0]), 0], atol=1e-4)


@pytest.mark.parametrize(
    ("start", "goal", "length"),
    [(3, -3, 0.2832), (-3, 3, 0.2832), (6.2, 6.4, 0.2), (1000, 1000.3, 0.3), (0, 7, 0.7168)],
)  # fmt: skip
def test_a_hinge_without_limits_goes_the_short_way(free, start, goal, length):
    plan = free.plan([start, 0.3], [goal, 0.3])
    assert_is_a_way(free, plan, [start, 0.3], [goal, 0.3])
    assert plan.length == pytest.approx(length, abs=2e-3)


def test_a_wall_is_passed_on_the_other_side(blocked):
    rng = np.random.default_rng(0)
    for seed in range(8):
        start = np.array([rng.uniform(-2.5, -0.6), rng.uniform(-1, 1)])
        goal = np.array([rng.uniform(0.6, 2.5), rng.uniform(-1, 1)])
        start[0] += 2 * np.pi * rng.integers(-3, 4)
        plan = blocked.plan(start, goal, seed)
        assert_is_a_way(blocked, plan, start, goal)
        assert np.ptp(plan.path[:, 0]) > 1.2


def test_limits_that_are_given_are_kept(blocked):
    """With limits the hinge is a line: round the back is another place."""
    scene, config = blocked.scene, PlannerConfig(max_expansions=400)
    wide = Planner(scene, config, q_min=[-12, -2], q_max=[12, 2])
    assert not wide.circular.any()
    np.testing.assert_array_equal(wide.q_max, [12, 2])
    assert not wide.plan([-0.8, 0], [0.8, 0]).solved
    plan = wide.plan([-0.8, 0], [0.8 - 2 * np.pi, 0])
    assert plan.solved
    np.testing.assert_allclose(plan.path[-1], [0.8 - 2 * np.pi, 0], atol=1e-5)
    over = wide.plan([-0.8, 0], [12.5, 0])
    assert over.status == Status.OUT_OF_LIMITS
    assert "12.0000 rad" in over.reason


RAIL = """<mujoco><worldbody><geom size=".1" pos="5 0 2"/><body>
  <joint type="slide" axis="1 0 0" {limits}/><geom size=".1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    ("limits", "start", "goal"),
    [('range="0 25"', 12, 25), ('range="0 25"', 0, 24), ('limited="false"', -30, 40)],
)
def test_a_rail_is_as_long_as_it_is(limits, start, goal):
    planner = Planner(Scene.from_mjcf(RAIL.format(limits=limits)))
    plan = planner.plan([start], [goal])
    assert plan.solved
    np.testing.assert_allclose(plan.path[[0, -1], 0], [start, goal], atol=1e-5)


WALL = """<mujoco><worldbody>
  <geom name="wall" type="box" size=".0005 .4 1" pos=".5037 -.1 0"/><body>
  <joint type="slide" axis="1 0 0" range="0 1"/>
  <joint type="slide" axis="0 1 0" range="-.5 {top}"/><geom size=".002"/></body>
</worldbody></mujoco>"""


def test_a_small_robot_does_not_go_through_a_wall_of_a_millimetre():
    planner = Planner(Scene.from_mjcf(WALL.format(top=0.5)))
    for seed in range(4):
        plan = planner.plan([0, 0], [1, 0], seed)
        assert plan.solved
        assert planner.certify(plan, continuous=True).valid
        assert planner.certify(planner.time(plan).q, resolution=0.0002).valid
    assert not planner.certify([[0, 0], [1, 0]]).valid
    shut = Planner(
        Scene.from_mjcf(WALL.format(top=0.2)), PlannerConfig(max_expansions=300)
    )
    assert shut.plan([0, 0], [1, 0]).status == Status.BUDGET_EXHAUSTED

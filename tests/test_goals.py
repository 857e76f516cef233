"""Goals that are several configurations, or a pose of a body."""

import mujoco
import numpy as np
import pytest

from jaxplan import Planner, PlannerConfig, Pose, Scene, Status
from jaxplan.collision import clearance_mujoco
from jaxplan.collision.touching import random_poses

ARM = """<mujoco><compiler angle="radian"/>
  <default><joint axis="0 1 0" range="-2.2 2.2"/><geom type="sphere"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 .1"/>
    <geom name="post" type="box" size=".05 .05 .25" pos=".35 0 .25"/>
    <body pos="0 0 .15"><joint axis="0 0 1" range="-3 3"/><geom size=".07"/>
      <body pos="0 0 .1"><joint/><geom size=".05" pos="0 0 .15"/>
        <body pos="0 0 .3"><joint/><geom size=".045" pos="0 0 .1"/>
          <body name="hand" pos="0 0 .25"><joint/><geom size=".04" pos="0 0 .03"/>
            <body name="tool" pos="0 0 .08"><joint axis="0 0 1" range="-2 2"/>
              <geom size=".02"/></body></body></body></body></body>
  </worldbody></mujoco>"""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(ARM)


@pytest.fixture(scope="module")
def planner(scene) -> Planner:
    return Planner(scene, PlannerConfig(max_expansions=3000))


@pytest.fixture(scope="module")
def poses(scene, planner):
    q = random_poses(scene, 400)
    distance = clearance_mujoco(scene, planner.empty_world, q)
    return q[distance > 0.01], q[distance < -0.005]


def test_any_of_several_goals_will_do(planner, poses):
    free, colliding = poses
    reached = set()
    for row in range(12):
        goals = np.stack([free[row + 40], colliding[row], free[row + 60], [9.0] * 5])
        plan = planner.plan(free[row], goals, seed=row)
        assert plan.solved
        np.testing.assert_allclose(plan.path[0], free[row], atol=1e-6)
        ends = np.abs(goals - plan.path[-1]).max(1)
        reached.add(int(ends.argmin()))
        assert ends.min() < 1e-5
        assert planner.certify(plan).valid
    assert reached == {0, 2}


def test_a_set_of_one_is_one_goal(planner, poses):
    free, _ = poses
    one = planner.plan(free[0], free[1], seed=5)
    also = planner.plan(free[0], free[[1]], seed=5)
    np.testing.assert_array_equal(one.path, also.path)


def test_a_batch_of_sets_and_of_poses(planner, scene, poses):
    free, _ = poses
    plans = planner.plan_batch(free[:4], free[4:16].reshape(4, 3, 5))
    for row, plan in enumerate(plans):
        assert plan.solved
        alone = planner.plan(free[row], free[4 + 3 * row : 7 + 3 * row], seed=row)
        np.testing.assert_array_equal(alone.path, plan.path)
    asked = [pose_at(scene, q) for q in free[20:23]]
    mixed = planner.plan_batch(free[:4], [*asked, free[23]])
    assert all(plan.solved for plan in mixed)
    np.testing.assert_allclose(mixed[3].path[-1], free[23], atol=1e-6)


def test_sets_without_a_free_goal_say_how_many_there_were(planner, poses):
    free, colliding = poses
    plan = planner.plan(free[0], colliding[:3])
    assert plan.status == Status.GOAL_IN_COLLISION
    assert plan.reason.startswith("3 goals, all in collision; the nearest: ")
    assert " deep" in plan.reason
    mixed = planner.plan(free[0], np.stack([colliding[0], [9.0] * 5]))
    assert "1 goals, all in collision, 1 out of limits" in mixed.reason
    far = planner.plan(free[0], np.full((2, 5), 9.0))
    assert far.status == Status.OUT_OF_LIMITS


def pose_at(scene: Scene, q: np.ndarray, body: str = "tool") -> Pose:
    """Where C MuJoCo has a body."""
    model, data = scene.mj_model, mujoco.MjData(scene.mj_model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return Pose(body, data.body(body).xpos.copy(), data.body(body).xquat.copy())


def test_a_pose_is_planned_to(planner, scene, poses):
    free, _ = poses
    for row in range(20):
        wanted = pose_at(scene, free[30 + row])
        plan = planner.plan(free[row], wanted, seed=row)
        assert plan.solved, plan.reason
        there = pose_at(scene, plan.path[-1])
        assert np.linalg.norm(np.subtract(there.position, wanted.position)) < 1e-3
        turned = 2 * np.arccos(min(1, abs(np.dot(there.quaternion, wanted.quaternion))))
        assert turned < np.radians(0.1) + 1e-6
        assert planner.certify(plan).valid


def test_ik_is_free_and_sorted(planner, scene, poses):
    free, _ = poses
    pose, reference = pose_at(scene, free[50]), free[51]
    q = planner.ik(pose, reference=reference)
    assert len(q)
    assert np.all(planner.clearance(q) > 0)
    distance = np.linalg.norm(q - reference, axis=1)
    assert np.all(np.diff(distance) >= 0)


def test_poses_that_cannot_be_reached_say_why(planner, scene, poses):
    free, _ = poses
    away = planner.plan(free[0], Pose("tool", [5, 0, 0]))
    assert away.status == Status.GOAL_UNREACHABLE
    assert "no configuration" in away.reason
    in_post = planner.plan(free[0], Pose("tool", [0.35, 0, 0.25]))
    assert in_post.status == Status.GOAL_IN_COLLISION
    assert "all in collision" in in_post.reason
    assert "post" in in_post.reason
    with pytest.raises(ValueError, match="no body"):
        planner.plan(free[0], Pose("tol", [0.3, 0, 0.5]))


@pytest.mark.parametrize("method", ["rrt", "ao_rrt_connect"])
def test_other_methods_plan_to_the_nearest(scene, poses, method):
    free, _ = poses
    config = PlannerConfig(method=method, max_expansions=400, goal_bias=0.3)
    planner = Planner(scene, config)
    plan = planner.plan(free[0], free[[1, 2, 3]])
    gaps = np.linalg.norm(free[1:4] - free[0], axis=1)
    if plan.solved:
        end = np.abs(free[1:4] - plan.path[-1]).max(1).argmin()
        assert end == gaps.argmin()

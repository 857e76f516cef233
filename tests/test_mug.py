"""The mug task: its range, its physics, its expert."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxplan import tasks
from jaxplan.base import Action
from jaxplan.config import PAPER_PLANNER
from jaxplan.robots import PANDA
from jaxplan.robots.kinematics import InverseKinematics
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.expert import Expert, Toggle
from jaxplan.tasks.mug.mug import MugShape, collision_boxes, planning_spheres
from jaxplan.tasks.mug.poses import RANGE, sample_pose
from jaxplan.tasks.mug.task import MugTask
from jaxplan.tasks.mug.variant import BOX


@pytest.fixture(scope="module")
def model():
    return scene.build("physics")


@pytest.fixture(scope="module")
def task():
    return MugTask(24)


def test_nothing_is_welded(model):
    """Grasps hold by friction: no equality constraint, no mocap body."""
    assert model.neq == 0
    assert model.nmocap == 0


def test_the_range_is_wide_enough():
    assert np.ptp(RANGE.x) >= 0.15 - 1e-9
    assert np.ptp(RANGE.y) >= 0.25
    assert np.degrees(np.ptp(RANGE.yaw)) >= 100


def test_reset_is_reproducible_and_in_range(task):
    """A seed gives the same state bit for bit, in whatever lane and company."""
    lanes = range(24)
    task.reset(lanes, range(24))
    first = np.array([task.sim.data[e].qpos for e in lanes])
    assert [task.unfit(e) for e in lanes] == [None] * 24
    task.reset([5], [0])
    np.testing.assert_array_equal(task.sim.data[5].qpos, first[0])
    sides = {
        bool(np.cross(task.object_pose(e)[:3, 2], task.object_pose(e)[:3, 0])[2] > 0)
        for e in lanes
        if e != 5
    }
    assert sides == {False, True}, "the handle lies on either side"


def test_a_settled_mug_stays_where_it_is(task):
    """At most it still rocks on its handle: 2 mm in the next second."""
    lanes = range(8)
    task.reset(lanes, range(100, 108))
    before = np.array([task.object_pose(e)[:3, 3] for e in lanes])
    task.wait(lanes, 1.0)
    after = np.array([task.object_pose(e)[:3, 3] for e in lanes])
    assert np.linalg.norm(after - before, axis=1).max() < 2e-3


def test_samples_fill_the_range():
    poses = [sample_pose(seed) for seed in range(300)]
    positions = np.array([p for p, _ in poses])
    yaw = np.array([np.arctan2(r[1, 2], r[0, 2]) for _, r in poses])
    for values, (low, high) in zip(
        (*positions.T[:2], yaw), (RANGE.x, RANGE.y, RANGE.yaw), strict=True
    ):
        assert low <= values.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < values.max() <= high


def test_planning_spheres_cover_the_mug():
    """No corner of a box sticks out of the held mug's spheres by half of the planner's margin."""
    shape = MugShape()
    spheres = planning_spheres(shape)
    centres, radii = map(np.array, zip(*spheres, strict=True))
    for name, centre, half, angle in collision_boxes(shape):
        if name.startswith("bottom"):
            continue  # the mug's floor lies inside its wall
        corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * half
        corners = Rotation.from_euler("z", angle).apply(corners) + centre
        outside = np.linalg.norm(corners[:, None] - centres, axis=2) - radii
        if name.startswith("wall"):  # the inner corners need no cover
            corner_radius = np.hypot(corners[:, 0], corners[:, 1])
            outside = outside[corner_radius > shape.radius - shape.wall / 2]
        assert outside.min(axis=1).max() < PAPER_PLANNER.margin / 2, name


def test_inverse_kinematics_reaches_its_pose(model):
    """FK of the answer is the pose asked for, inside the limits."""
    ik = InverseKinematics(PANDA, model)
    rng = np.random.default_rng(0)
    for _ in range(10):
        q_target = PANDA.q_home + rng.normal(0, 0.2, 7)
        position, rotation = ik.pose(q_target)
        q, error = ik.solve(position, rotation, PANDA.q_home)
        assert error < 1e-3
        reached, _ = ik.pose(q)
        np.testing.assert_allclose(reached, position, atol=1e-3)
        assert np.all(q >= model.jnt_range[:7, 0])
        assert np.all(q <= model.jnt_range[:7, 1])


def test_labels_do_not_jump(model):
    """Along lines through the range a millimetre moves the grasp by little."""
    expert = Expert(InverseKinematics(PANDA, model))
    rng = np.random.default_rng(1)
    for side in (-1, 1):
        start, end = (
            rng.uniform(*np.array([RANGE.x, RANGE.y, RANGE.yaw]).T) for _ in range(2)
        )
        grasps = []
        for s in np.linspace(0, 1, 60):
            x, y, yaw = start + s * (end - start)
            axis = np.array([np.cos(yaw), np.sin(yaw), 0.0])
            handle = np.cross(axis, [0, 0, 1.0]) * side
            mug = np.eye(4)
            mug[:3, :3] = np.stack([handle, np.cross(axis, handle), axis], 1)
            mug[:3, 3] = x, y, 0.04
            keyframes = expert.keyframes(mug, PANDA.q_home, closed=False)
            assert keyframes.toggle == Toggle.GRASP1
            grasps.append(keyframes.q[-1])
        assert np.abs(np.diff(grasps, axis=0)).max() < 0.06


def test_the_judge_names_what_is_wrong(task):
    """A mug put in the box by hand counts; tilted, moving or outside it does not."""
    task.reset([0], [0])
    data = task.sim.data[0]

    def place(position, quat=(1, 0, 0, 0)):
        data.qpos[9:16] = [*position, *quat]
        data.qvel[:] = 0
        mujoco.mj_forward(task.model, data)
        return task.failure(0)

    x, y, _ = BOX
    z = scene.BOX_FLOOR + MugShape().height / 2
    assert place([x, y, z]) is None
    assert "outside" in place([x + 0.2, y, z])
    assert "upright" in place([x, y, z], (0.7071, 0.7071, 0, 0))
    data.qpos[9:16] = [x, y, z, 1, 0, 0, 0]
    data.qvel[9] = 0.1
    assert "rest" in task.failure(0)


def test_a_grasp_holds_the_mug(task):
    """Lifted by the rim, the mug slips less than a millimetre."""
    task.reset([0], [3])
    expert = Expert(task.kinematics)
    for q in expert.keyframes(task.object_pose(0), task.sim.q(0), False).q:
        move(task, q)
        np.testing.assert_allclose(task.sim.q(0), q, atol=0.03)
    move(task, q, close=True)
    assert task.held(0)
    before = mug_in_hand(task)
    move(task, expert.keyframes(task.object_pose(0), task.sim.q(0), True).q[0])
    assert task.object_pose(0)[2, 3] > 0.15
    assert np.linalg.norm((mug_in_hand(task) - before)[:3, 3]) < 1e-3


def move(task, q, close=None):
    """A straight motion of 1.5 s, from rest to rest, and what the gripper does at its end."""
    s = np.linspace(0, 1, 150)[:, None]
    start = task.sim.q(0)
    way = start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (q - start)
    mode = np.full(150, task.closed[0])
    mode[-1] = task.closed[0] if close is None else close
    task.execute(
        [0],
        Action(
            q=[way],
            gripper=[mode],
            q_toggle=q[None],
            tolerance=0.03,
            settle=0.15,
            done=np.zeros(task.batch, bool),
            notes={},
        ),
    )


def mug_in_hand(task):
    return np.linalg.inv(task.hand_pose(task.sim.data[0])) @ task.object_pose(0)


def test_unknown_names_are_refused():
    for settings, line in (
        (("cup",), "task 'cup': there is mug"),
        (("mug", 1, "shelf"), "variant 'shelf' of mug: plain or cluttered or ways"),
        (("mug", 1, "plain", "top"), "camera 'top': there is static or hand"),
    ):
        with pytest.raises(ValueError, match=line):
            tasks.load(*settings, **({} if len(settings) > 1 else {"batch": 1}))
    assert tasks.names() == ["mug"]

"""The Panda as spheres and the problems around it, by plain chain maths and C MuJoCo."""

import mujoco
import numpy as np
import pytest

from jaxplan.collision import Obstacle
from jaxplan.evaluation.motion_bench import (
    HOME,
    data_directory,
    obstacles_mjcf,
    read_problems,
    read_robot,
    robot_mjcf,
    sphere_cage,
    table,
)
from jaxplan.scene import find_contacts, geom_pairs

SETS = "cage", "box", "bookshelf_small", "table_pick"


@pytest.fixture(scope="module")
def robot() -> dict:
    return read_robot(data_directory())


def model_of(robot, obstacles=()) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(robot_mjcf(robot, obstacles_mjcf(obstacles)))


def free(model, q) -> bool:
    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    return data.ncon == 0


def rotation(axis, angle) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def transform(turn, xyz) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, xyz
    return matrix


def chain(robot, q) -> dict[str, np.ndarray]:
    """Poses of the links as URDF defines them: R = Rz(yaw) Ry(pitch) Rx(roll)."""
    poses, angles = {"panda_link0": np.eye(4)}, iter(q)
    for joint in robot["joints"]:
        roll, pitch, yaw = joint["rpy"]
        x, y, z = np.eye(3)
        turn = rotation(z, yaw) @ rotation(y, pitch) @ rotation(x, roll)
        if joint["type"] == "revolute":
            turn = turn @ rotation(joint["axis"], next(angles))
        placed = transform(turn, joint["xyz"])
        poses[joint["child"]] = poses[joint["parent"]] @ placed
    return poses


def test_spheres_are_where_the_chain_puts_them(robot):
    model = model_of(robot)
    data = mujoco.MjData(model)
    assert model.ngeom == sum(map(len, robot["links"].values()))
    for q in np.random.default_rng(0).uniform(*model.jnt_range.T, (5, 7)):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        for link, pose in chain(robot, q).items():
            np.testing.assert_allclose(data.body(link).xpos, pose[:3, 3], atol=1e-9)
            ids = np.flatnonzero(model.geom_bodyid == model.body(link).id)
            spheres = robot["links"][link]
            assert [s["radius"] for s in spheres] == [*model.geom_size[ids, 0]]
            for sphere, geom in zip(spheres, ids, strict=True):
                expected = pose @ [*sphere["position"], 1]
                np.testing.assert_allclose(
                    data.geom_xpos[geom], expected[:3], atol=1e-9
                )


def test_joints_limits_key_frame_and_pairs(robot):
    model = model_of(robot)
    revolute = [j for j in robot["joints"] if j["type"] == "revolute"]
    assert [model.joint(i).name for i in range(7)] == [j["name"] for j in revolute]
    np.testing.assert_array_equal(model.jnt_range, [j["limit"] for j in revolute])
    np.testing.assert_array_equal(model.key("home").qpos, HOME)
    pairs = {pair for c in find_contacts(model) for pair in geom_pairs(c)}
    never = {frozenset(pair) for pair in robot["disable_collisions"]}
    names = [model.body(b).name for b in model.geom_bodyid]
    expected = {
        (i, j)
        for i in range(model.ngeom)
        for j in range(i)
        if names[i] != names[j] and frozenset((names[i], names[j])) not in never
    }
    # MuJoCo's own filter (welded, parent and child) drops nothing that the file checks.
    assert {tuple(sorted(p, reverse=True)) for p in pairs} == expected
    assert len(pairs) > 500


def test_starts_and_goals_are_free(robot):
    problems = read_problems(data_directory())
    assert [*problems] == [*SETS]
    assert min(map(len, problems.values())) >= 24
    for problem in [p for rows in problems.values() for p in rows]:
        model = model_of(robot, problem.obstacles)
        for q in (problem.q_start, problem.q_goal):
            assert (model.jnt_range[:, 0] <= q).all()
            assert (q <= model.jnt_range[:, 1]).all()
            assert free(model, q), f"{problem.set} {problem.index}"


@pytest.mark.parametrize("problem", [sphere_cage(), table()], ids=lambda p: p.set)
def test_the_straight_line_is_blocked_but_not_its_ends(robot, problem):
    model = model_of(robot, problem.obstacles)
    line = np.linspace(problem.q_start, problem.q_goal, 100)
    verdicts = [free(model, q) for q in line]
    assert verdicts[0]
    assert verdicts[-1]
    assert not all(verdicts)


def test_obstacles_have_mujocos_sizes_and_quaternions():
    """A probe at a box's corner, and one over a cylinder's cap, touch what they should."""
    quarter = [np.cos(np.pi / 4), np.sin(np.pi / 4), 0, 0]  # about x: z becomes -y
    box = Obstacle("box", [0.1, 0.2, 0.3], [1, 0, 0, *quarter])
    can = Obstacle("cylinder", [0.05, 0.2], [0, 0, 1, *quarter])
    corner = [1.1, -0.3, 0.2 + 0.1]  # 0.1 above the corner
    cap = [0, 0.2 + 0.1, 1.04]  # 0.1 beyond the cap, near its rim
    probes = "".join(
        f'<body pos="{x} {y} {z}"><freejoint/><geom name="{name}" size="0.01"/></body>'
        for name, (x, y, z) in (("corner", corner), ("cap", cap))
    )
    text = (
        f"<mujoco><worldbody>{obstacles_mjcf([box, can])}{probes}</worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom, probe in (("box0", "corner"), ("cylinder1", "cap")):
        ids = model.geom(geom).id, model.geom(probe).id
        distance = mujoco.mj_geomDistance(model, data, *ids, 1, None)
        assert distance == pytest.approx(0.09, abs=1e-6)


def test_files_are_read_into_the_same_convention():
    """Full lengths become half lengths, xyzw becomes wxyz."""
    box_1 = next(p for p in read_problems(data_directory())["box"] if p.index == 1)
    can = next(o for o in box_1.obstacles if o.kind == "cylinder")
    np.testing.assert_allclose(can.size, [0.03, 0.07])
    np.testing.assert_allclose(can.pose[:3], [0.5408381, 0.3580155, -0.3762264])
    np.testing.assert_allclose(can.pose[3:], [0.9972532, 0, 0, 0.0740684])


def test_missing_files_are_named(tmp_path):
    for read, name in (
        (read_robot, "panda_spheres"),
        (read_problems, "panda_problems"),
    ):
        with pytest.raises(FileNotFoundError, match=rf"{name}.json .*JAXPLAN_MOTION"):
            read(tmp_path)

"""Inverse kinematics: C MuJoCo's kinematics say whether a body is where it was wanted."""

import math
from collections.abc import Iterator
from functools import partial

import jax
import mujoco
import numpy as np
import pytest

from jaxplan import Pose, Scene, make_world
from jaxplan.collision import XLA_OPTIONS
from jaxplan.collision.kinematics import frame_jacobian, frame_pose
from jaxplan.ik import Limits, inverse_kinematics, inverse_kinematics_batch
from jaxplan.ik.descent import LANES
from jaxplan.ik.inverse import SAME, limits_of

ARM = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default><geom size="0.01" contype="0" conaffinity="0"/></default>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" range="-0.5 0.5"/>
      <joint name="jack" type="slide" axis="0 0 1"/>
      <geom/>
      <body name="column" pos="0 0 0.2">
        <joint name="turn" axis="0 0 1"/>
        <geom/>
        <body name="upper_arm" pos="0 0 0.1" euler="0 0 0.3">
          <joint name="lift" axis="0 1 0" pos="0.02 0 0.01" range="-2 2"/>
          <geom/>
          <body name="forearm" pos="0 0 0.35">
            <joint name="elbow" axis="0 1 0" range="-2.5 2.5" ref="0.3"/>
            <geom/>
            <body name="wrist" pos="0 0 0.3" euler="0.1 0 0">
              <joint name="roll" axis="0 0 1" range="-3 3"/>
              <joint name="bend" axis="0 1 0" range="-2 2"/>
              <geom/>
              <body name="hand" pos="0 0 0.1">
                <joint name="spin" axis="0 0 1"/>
                <geom/>
                <site name="tip" pos="0.02 0 0.1" euler="0 0.5 0"/>
                <body name="finger"><joint name="finger" axis="0 1 0"/><geom/></body>
              </body>
            </body>
          </body>
        </body>
        <body name="head" pos="0 0.2 0"><joint name="nod" axis="0 1 0"/><geom/></body>
      </body>
    </body>
    <body name="mug" pos="1 0 0"><freejoint/><geom/></body>
  </worldbody>
  <equality><joint joint1="finger" joint2="lift" polycoef="0.1 0.5 0 0 0"/></equality>
</mujoco>
"""
JOINTS = ("rail", "turn", "lift", "elbow", "roll", "bend", "spin", "nod")
Q = np.array([0.2, 0.5, 0.7, 0.9, -0.4, 0.8, 0.3, 0.0])
MILLIMETRE, TENTH = 1e-3, math.radians(0.1)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(ARM, joints=JOINTS, hand="hand")


@pytest.fixture(scope="module")
def world(scene):
    return make_world(scene, passive=[0.05])


@pytest.fixture
def compilations() -> Iterator[list[str]]:
    """Grows by one for everything that XLA compiles."""
    heard: list[str] = []

    def listen(event: str, *_, **__) -> None:
        if "backend_compile" in event:
            heard.append(event)

    jax.monitoring.register_event_duration_secs_listener(listen)
    yield heard
    jax.monitoring.unregister_event_duration_listener(listen)


def placed(scene: Scene, q: np.ndarray, passive=()) -> mujoco.MjData:
    """C MuJoCo's kinematics; the finger follows `lift`."""
    data = mujoco.MjData(scene.mj_model)
    for names, values in ((scene.joints, q), (scene.passive, passive)):
        for name, value in zip(names, values, strict=True):
            data.joint(name).qpos[:] = value
    if "finger" in scene.structure.joint_names:
        data.joint("finger").qpos[:] = 0.1 + 0.5 * data.joint("lift").qpos
    mujoco.mj_kinematics(scene.mj_model, data)
    mujoco.mj_comPos(scene.mj_model, data)
    return data


def pose_at(data: mujoco.MjData, name: str, offset=(0, 0, 0), **region) -> Pose:
    """Where a body, or a site, is."""
    site = name == "tip"
    frame = data.site(name) if site else data.body(name)
    turn, quaternion = frame.xmat.reshape(3, 3), np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, frame.xmat)
    return Pose(name, frame.xpos + turn @ offset, quaternion, offset=offset, **region)


def errors(data: mujoco.MjData, pose: Pose) -> tuple[np.ndarray, float]:
    """`[3]` how far a body is from where it is wanted [m], and its angle [rad]."""
    frame = data.site("tip") if pose.body == "tip" else data.body(pose.body)
    turn = frame.xmat.reshape(3, 3)
    away = np.abs(frame.xpos + turn @ pose.offset - pose.position)
    if pose.quaternion is None:
        return away, 0.0
    wanted = np.zeros(9)
    mujoco.mju_quat2Mat(wanted, pose.quaternion)
    wanted = wanted.reshape(3, 3)
    if pose.free:
        axis = "xyz".index(pose.free)
        a, b = turn[:, axis], wanted[:, axis]
        return away, math.atan2(np.linalg.norm(np.cross(a, b)), a @ b)
    relative = turn @ wanted.T
    sine = np.linalg.norm(relative - relative.T) / math.sqrt(8)
    return away, math.atan2(sine, (np.trace(relative) - 1) / 2)


def assert_reaches(scene, q, pose: Pose, passive=()) -> None:
    away, angle = errors(placed(scene, q, passive), pose)
    assert (away <= pose.position_tolerance).all()
    assert angle <= pose.rotation_tolerance
    assert (q >= np.asarray(scene.q_min)).all()
    assert (q <= np.asarray(scene.q_max)).all()


def random_tree(seed: int) -> Scene:
    """Hinges and slides one after the other, or two on a body, with branches aside."""
    rng = np.random.default_rng(seed)

    def row(low: float, high: float, size: int = 3) -> str:
        return " ".join(map(str, rng.uniform(low, high, size).round(3)))

    text, joints = "", []
    for i in range(7):
        text += f'<body name="b{i}" pos="{row(-0.3, 0.3)}" euler="{row(-3, 3)}"><geom/>'
        for j in range(rng.integers(0, 3) if i in (2, 4) else 1):
            kind = "slide" if rng.random() < 0.2 else "hinge"
            joints.append(f"j{i}{j}")
            text += (
                f'<joint name="{joints[-1]}" type="{kind}" axis="{row(-1, 1)}" '
                f'pos="{row(-0.1, 0.1)}" range="-1.{i} 2" ref="{row(-1, 1, 1)}"/>'
            )
        text += f'<body name="side{i}" pos="{row(-1, 1)}"><joint name="s{i}"/><geom/></body>'
    passive = joints.pop(3)
    text = f"""<mujoco><compiler angle="radian" autolimits="true"/>
    <default><geom size="0.01" contype="0" conaffinity="0"/></default>
    <worldbody>{text}{"</body>" * 7}</worldbody></mujoco>"""
    scene = Scene.from_mjcf(text, joints=joints)
    assert passive in scene.passive
    return scene


def uniform(scene: Scene, rng: np.random.Generator, rows: int) -> np.ndarray:
    low, high = np.maximum(scene.q_min, -3), np.minimum(scene.q_max, 3)
    return rng.uniform(low, high, (rows, len(scene.joints)))


@pytest.fixture(scope="module", params=range(2))
def tree(request):
    """A scene, a world, positions of its passive joints, and 64 configurations."""
    scene = random_tree(request.param)
    rng = np.random.default_rng(request.param)
    passive = rng.uniform(-1, 1, len(scene.passive))
    return scene, make_world(scene, passive=passive), passive, uniform(scene, rng, 64)


def test_frames_and_jacobians_are_mujocos(tree):
    scene, world, passive, q = tree
    poses = jax.jit(frame_pose, static_argnums=3, compiler_options=XLA_OPTIONS)
    jacobians = jax.jit(frame_jacobian, static_argnums=3, compiler_options=XLA_OPTIONS)
    q = q[:8].astype(np.float32)
    rows = jax.tree.map(lambda leaf: leaf[..., None], world)
    body = "side4"
    pose = np.asarray(poses(scene, world, q.reshape(2, 4, -1), body))
    again, jacobian = jacobians(scene, rows, q.T, body)
    assert pose.shape == (2, 4, 3, 4)
    np.testing.assert_allclose(pose.reshape(8, 3, 4), np.moveaxis(again, -1, 0))
    for i in range(8):
        data = placed(scene, q[i], passive)
        frame = data.body(body)
        expected = np.c_[frame.xmat.reshape(3, 3), frame.xpos]
        np.testing.assert_allclose(pose.reshape(8, 3, 4)[i], expected, atol=2e-6)
        parts = np.zeros((2, 3, scene.mj_model.nv))
        mujoco.mj_jacBody(scene.mj_model, data, *parts, frame.id)
        columns = [int(data.joint(name).id) for name in scene.joints]
        expected = parts[:, :, columns].reshape(6, -1)
        np.testing.assert_allclose(jacobian[..., i], expected, atol=3e-6)


def test_poses_of_random_trees_are_reached(tree):
    scene, world, passive, q = tree
    poses = [pose_at(placed(scene, row, passive), "b6") for row in q]
    found, reached = inverse_kinematics_batch(scene, world, poses)
    assert reached.all()
    for row, pose in zip(found, poses, strict=True):
        assert_reaches(scene, row, pose, passive)


def test_a_world_of_each_row(scene):
    rng = np.random.default_rng(0)
    passive, q = rng.uniform(-1, 1, (5, 1)), uniform(scene, rng, 5)
    many = make_world(scene, passive=passive)
    pose = np.asarray(jax.jit(frame_pose, static_argnums=3)(scene, many, q, "finger"))
    for i in range(5):
        frame = placed(scene, q[i], passive[i]).body("finger")
        np.testing.assert_allclose(pose[i, :, 3], frame.xpos, atol=2e-6)
        np.testing.assert_allclose(pose[i, :, :3].ravel(), frame.xmat, atol=2e-6)


def test_what_the_hand_holds_has_a_frame_too(scene):
    held = [[0.1, 0, 0.2, 0.6, 0, 0.8, 0]]
    world = make_world(scene, object_pose=held, held=[True], passive=[0.05])
    pose = np.asarray(jax.jit(frame_pose, static_argnums=3)(scene, world, Q, "mug"))
    hand = placed(scene, Q, [0.05]).body("hand")
    position, quaternion, turn = np.zeros(3), np.zeros(4), np.zeros(9)
    mujoco.mju_mulPose(
        position,
        quaternion,
        hand.xpos,
        hand.xquat,
        np.array(held[0][:3]),
        np.array(held[0][3:]),
    )
    mujoco.mju_quat2Mat(turn, quaternion)
    np.testing.assert_allclose(pose, np.c_[turn.reshape(3, 3), position], atol=2e-6)


REGIONS = {
    "pose": {},
    "point": {"offset": (0.1, -0.05, 0.2)},
    "free x": {"free": "x"},
    "free y": {"free": "y", "offset": (0.1, 0, 0.1)},
    "free z": {"free": "z"},
    "box": {"position_tolerance": (0.1, 0.2, 0.01)},
    "plane": {"position_tolerance": (np.inf, np.inf, 1e-3)},
    "cone": {"rotation_tolerance": 0.4},
    "free z, cone": {"free": "z", "rotation_tolerance": 0.3},
    "fine": {"position_tolerance": 2e-5, "rotation_tolerance": 2e-5},
}


@pytest.mark.parametrize("name", ["hand", "tip"])
@pytest.mark.parametrize("region", REGIONS)
def test_solutions_are_in_the_region(scene, world, region, name):
    pose = pose_at(placed(scene, Q, [0.05]), name, **REGIONS[region])
    found = inverse_kinematics(scene, world, pose, reference=np.zeros(8), count=40)
    assert len(found.q) >= 4
    assert len(found.blocked) == 0
    for q in found.q:
        assert_reaches(scene, q, pose, [0.05])
    distance = np.linalg.norm(found.q, axis=1)
    np.testing.assert_allclose(found.distance, distance)
    assert (np.diff(found.distance) >= 0).all()
    apart = np.abs(found.q[:, None] - found.q).max(-1)
    assert (apart[~np.eye(len(apart), dtype=bool)] > SAME).all()
    fewer = inverse_kinematics(scene, world, pose, reference=np.zeros(8), count=3)
    assert len(fewer.q) == 3
    np.testing.assert_array_equal(fewer.q[0], found.q[0])
    assert (found.q == fewer.q[:, None]).all(-1).any(1).all()


def test_any_orientation_will_do(scene, world):
    position = placed(scene, Q, [0.05]).body("hand").xpos
    pose = Pose("hand", position)
    found = inverse_kinematics(scene, world, pose)
    turns = [placed(scene, q, [0.05]).body("hand").xmat.copy() for q in found.q]
    for q in found.q:
        assert_reaches(scene, q, pose, [0.05])
    assert np.std(turns, 0).max() > 0.3


def test_an_orientation_out_of_reach_is_reached_within_its_tolerance(scene, world):
    """The hand can come no higher than 1.1 m above the rail."""
    high = np.array([0.0, 0.0, 1.2])
    assert not len(inverse_kinematics(scene, world, Pose("hand", high)).q)
    region = Pose("hand", high, position_tolerance=(0.01, 0.01, 0.2))
    found = inverse_kinematics(scene, world, region)
    assert len(found.q)
    for q in found.q:
        assert_reaches(scene, q, region, [0.05])


def test_the_reference_itself_is_a_solution(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    found = inverse_kinematics(scene, world, pose, reference=Q)
    assert found.distance[0] < 1e-3


def test_what_does_not_move_the_body_stays_at_the_reference(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    reference = np.array([0, 0, 0, 0, 0, 0, 0, 1.234])
    found = inverse_kinematics(scene, world, pose, reference=reference)
    np.testing.assert_allclose(found.q[:, 7], 1.234, atol=1e-6)


def test_circular_joints_are_within_half_a_turn_of_the_reference(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    reference = Q + 2 * np.pi * np.array([0, 3, 0, 0, 0, 0, -5, 0])
    found = inverse_kinematics(scene, world, pose, reference=reference)
    turn = np.abs(found.q - reference)[:, [1, 6]]
    assert turn.max() <= np.pi + 1e-6
    assert turn.max() > 1
    assert found.distance[0] < 2e-3
    for q in found.q:
        assert_reaches(scene, q, pose, [0.05])


def test_slides_without_limits_go_far(scene, world):
    limits = limits_of(scene)
    wide = Limits(limits.q_min.copy(), limits.q_max.copy(), limits.circular)
    wide.q_min[0], wide.q_max[0] = -np.inf, np.inf
    q = np.array([12.0, *Q[1:]])
    pose = pose_at(placed(scene, q, [0.05]), "hand")
    assert not len(inverse_kinematics(scene, world, pose).q)
    for reference, least in ((None, 11), (q, 0)):
        found = inverse_kinematics(scene, world, pose, wide, reference=reference)
        assert len(found.q)
        assert found.distance[0] >= least
        away, angle = errors(placed(scene, found.q[0], [0.05]), pose)
        assert away.max() < MILLIMETRE
        assert angle < TENTH


def test_given_limits_are_kept(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    low, high = Q - 0.3, Q + 0.1
    limits = Limits(low, high, np.zeros(8, bool))
    found = inverse_kinematics(scene, world, pose, limits)
    assert len(found.q)
    assert ((found.q >= low) & (found.q <= high)).all()
    shut = Limits(low, np.array([*Q[:3], Q[3] - 0.05, *high[4:]]), limits.circular)
    shut.q_max[0] = low[0] + 0.1
    assert (inverse_kinematics(scene, world, pose, shut).q <= shut.q_max).all()


def test_a_pose_out_of_reach_has_no_solutions(scene, world):
    pose = Pose("hand", [3, 0, 0.5])
    found = inverse_kinematics(scene, world, pose)
    assert found.q.shape == found.blocked.shape == (0, 8)
    assert found.distance.shape == (0,)
    near = pose_at(placed(scene, Q, [0.05]), "hand")
    _, reached = inverse_kinematics_batch(scene, world, [pose, near, pose])
    assert reached.tolist() == [False, True, False]


def test_solutions_that_are_not_free_are_named_apart(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    asked = []

    def right(q):
        asked.append(q.shape)
        return q[:, 0] > 0

    solve = partial(inverse_kinematics, scene, world, pose, count=LANES)
    every = solve().q
    part = solve(config_free=right)
    assert len(part.q)
    assert (part.q[:, 0] > 0).all()
    assert (part.blocked[:, 0] <= 0).all()
    assert set(asked) == {(LANES, 8)}
    assert len(part.q) + len(part.blocked) == pytest.approx(len(every), abs=5)
    none = solve(config_free=lambda q: np.zeros(len(q), bool))
    assert none.q.shape == (0, 8)
    assert len(none.blocked) >= len(every)


def test_the_seed_decides(scene, world):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    first, again, other = (
        inverse_kinematics(scene, world, pose, seed=seed).q
        for seed in (1, 1, 2**32 - 1)
    )
    np.testing.assert_array_equal(first, again)
    assert first.shape != other.shape or not np.array_equal(first, other)
    poses = [pose_at(placed(scene, q, [0.05]), "hand") for q in (Q, Q * 0.5)]
    batches = [inverse_kinematics_batch(scene, world, poses)[0] for _ in range(2)]
    np.testing.assert_array_equal(*batches)


def test_nothing_compiles_anew(scene, world, compilations):
    pose = pose_at(placed(scene, Q, [0.05]), "hand")
    inverse_kinematics(scene, world, pose)
    inverse_kinematics_batch(scene, world, [pose])
    limits = limits_of(scene)
    other = Limits(limits.q_min - 0.1, limits.q_max + 0.1, limits.circular)
    worlds = [make_world(scene, passive=[x]) for x in (-0.3, 0.3)]
    compilations.clear()
    for region in REGIONS.values():
        for own, limit, q in ((worlds[0], limits, Q), (worlds[1], other, 0.7 * Q)):
            at = pose_at(placed(scene, q, [0]), "tip", **region)
            inverse_kinematics(scene, own, at, limit, q, seed=7, count=9)
            inverse_kinematics_batch(scene, own, [at] * 3, limit)
    inverse_kinematics_batch(scene, world, [pose] * (LANES + 1))
    assert compilations == []


def test_mink_finds_nothing_that_we_do_not(scene, world):
    """On 30 poses with four starts of 60 steps each; we may miss none of them."""
    mink = pytest.importorskip("mink")
    rng = np.random.default_rng(0)
    model, passive = mujoco.MjModel.from_xml_string(ARM), [0.05]
    for joint in ("turn", "spin", "nod"):
        model.joint(joint).range, model.jnt_limited[model.joint(joint).id] = (-3, 3), 1
    poses = [
        pose_at(placed(scene, q, passive), "hand") for q in uniform(scene, rng, 30)
    ]
    task = mink.FrameTask("hand", "body", 1.0, 0.3, lm_damping=1e-3)
    configuration = mink.Configuration(model)
    limits = [mink.ConfigurationLimit(model)]
    still = mink.DofFreezingTask(model, [model.joint("jack").dofadr[0]])

    def by_mink(pose: Pose) -> bool:
        turn = mink.SO3(np.asarray(pose.quaternion))
        task.set_target(mink.SE3.from_rotation_and_translation(turn, pose.position))
        for start in uniform(scene, rng, 4):
            configuration.update(placed(scene, start, passive).qpos)
            for _ in range(60):
                velocity = mink.solve_ik(
                    configuration, [task], 1.0, "daqp", 1e-6, False, limits, [still]
                )
                configuration.integrate_inplace(velocity, 1.0)
                away, angle = errors(configuration.data, pose)
                if np.linalg.norm(away) < MILLIMETRE and angle < TENTH:
                    return True
        return False

    theirs = np.array([by_mink(pose) for pose in poses])
    _, ours = inverse_kinematics_batch(scene, world, poses)
    assert theirs.sum() > 20
    assert not (theirs & ~ours).any()


def test_an_arm_on_a_floating_base():
    """The base stays where the world has it."""
    scene = Scene.from_mjcf(
        """<mujoco><default><geom size="0.01"/></default><worldbody>
        <body name="base"><freejoint/><geom/>
          <body><joint name="a" axis="0 0 1"/><geom/>
            <body pos="1 0 0"><joint name="b" axis="0 0 1"/><geom/>
              <body name="hand" pos="1 0 0"><geom/></body>
        </body></body></body></worldbody></mujoco>""",
        joints=["a", "b"],
    )
    world = make_world(scene, object_pose=[[5, 0, 0, 0.6, 0, 0, 0.8]])
    pose = Pose("hand", (5, 1.5, 0), position_tolerance=1e-4)
    found = inverse_kinematics(scene, world, pose)
    assert len(found.q) == 2  # elbow left, elbow right
    frames = jax.jit(frame_pose, static_argnums=3)(scene, world, found.q, "hand")
    np.testing.assert_allclose(frames[:, :, 3], [pose.position] * 2, atol=1e-4)


def test_the_caller_may_compute_in_double_precision(world):
    with jax.enable_x64(True):
        scene = Scene.from_mjcf(ARM, joints=JOINTS, hand="hand")
        pose = pose_at(placed(scene, Q, [0.05]), "hand")
        found = inverse_kinematics(scene, make_world(scene, passive=[0.05]), pose)
        frames = jax.jit(frame_pose, static_argnums=3)(scene, world, found.q, "hand")
        assert len(found.q) > 4
        for q, frame in zip(found.q, np.asarray(frames), strict=True):
            assert_reaches(scene, q, pose, [0.05])
            np.testing.assert_allclose(frame[:, 3], pose.position, atol=1e-3)


def test_a_batch_of_none(scene, world):
    q, reached = inverse_kinematics_batch(scene, world, [])
    assert q.shape == (0, 8)
    assert reached.shape == (0,)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"position": [0, 0]}, r"position has shape \(2,\), expected \(3,\)"),
        ({"position": [0, np.nan, 0]}, "position is not finite"),
        ({"position": "near"}, "position is not an array of numbers"),
        ({"quaternion": [0, 0, 0, 0]}, "quaternion is zero"),
        ({"quaternion": [1, 0, 0]}, "quaternion has shape"),
        ({"quaternion": [np.inf, 0, 0, 0]}, "quaternion is not finite"),
        ({"free": "w"}, "free 'w'"),
        ({"free": "z", "quaternion": None}, "free 'z' needs a quaternion"),
        ({"position_tolerance": -1}, "position_tolerance -1.0, expected at least"),
        ({"position_tolerance": [1, 0, 1]}, "position_tolerance .*, expected at least"),
        ({"position_tolerance": [1, 1]}, "position_tolerance has shape"),
        ({"rotation_tolerance": np.nan}, "rotation_tolerance nan"),
        ({"rotation_tolerance": [1, 1, 1]}, "rotation_tolerance has shape"),
        ({"offset": [0, 0, np.inf]}, "offset is not finite"),
        ({"body": 3}, "body 3, expected a name"),
    ],
)
def test_poses_that_make_no_sense_are_refused(values, words):
    good = {"body": "hand", "position": [0, 0, 0], "quaternion": [1, 0, 0, 0]}
    with pytest.raises(ValueError, match=words) as refusal:
        Pose(**(good | values))
    assert "\n" not in str(refusal.value)


def test_a_quaternion_of_any_length_is_one():
    pose = Pose("hand", (0, 0, 0), (1e-30, 0, 0, 1e-30))
    np.testing.assert_allclose(pose.quaternion, [0.5**0.5, 0, 0, 0.5**0.5])
    np.testing.assert_array_equal(pose.position_tolerance, [MILLIMETRE] * 3)


@pytest.mark.parametrize(
    ("body", "values", "words"),
    [
        ("hands", {}, "no body or site 'hands': did you mean 'hand'"),
        ("mug", {}, "no joint of the arm moves body 'mug'"),
        ("world", {}, "no joint of the arm moves body 'world'"),
        ("hand", {"count": 0}, "count 0"),
        ("hand", {"reference": [0, 1]}, r"reference has shape \(2,\)"),
        ("hand", {"reference": [np.nan] * 8}, "reference is not finite"),
    ],
)
def test_questions_that_make_no_sense_are_refused(scene, world, body, values, words):
    with pytest.raises(ValueError, match=words):
        inverse_kinematics(scene, world, Pose(body, (0, 0, 0)), **values)


def test_a_batch_is_of_one_body(scene, world):
    poses = [Pose("hand", (0, 0, 0)), Pose("head", (0, 0, 0))]
    with pytest.raises(ValueError, match="poses of one body at a time"):
        inverse_kinematics_batch(scene, world, poses)

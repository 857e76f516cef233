"""MotionBenchMaker's goals as poses of the hand: solved, and how fast.

    python eval/pose_goals.py --out runs/pose_goals.json

The pose is where C MuJoCo has the last link at the problem's own goal, so that it can be
reached by a free configuration. Ends are checked by C MuJoCo, paths are certified.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from parts.queries import planner_for
from tqdm import tqdm

from jaxplan import Pose, Scene
from jaxplan.cli import run_script
from jaxplan.evaluation import wilson
from jaxplan.evaluation.motion_bench import data_directory, read_problems, read_robot
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked


@dataclass(frozen=True)
class Args(Checked):
    """Plans to each problem's pose once."""

    out: Path = Path("runs/pose_goals.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the robots' spheres and the problems."""
    quick: bool = False
    """5 problems a set."""


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    robot, every = read_robot(args.data), read_problems(args.data)
    rows = {}
    for name, problems in every.items():
        problems = problems[: 5 if args.quick else None]
        planner, worlds = planner_for(robot, problems)
        solved, refused, seconds, off = 0, 0, [], [0.0]
        for seed in tqdm(range(len(problems)), desc=name, unit="problem"):
            problem, world = problems[seed], worlds[seed]
            pose = pose_at(planner.scene, problem.q_goal)
            if not seed:
                planner.plan(problem.q_start, pose, seed, world)  # compiles
            began = time.perf_counter()
            plan = planner.plan(problem.q_start, pose, seed, world)
            seconds.append(time.perf_counter() - began)
            if not plan.solved:
                print(f"{name} {problem.index}: {plan.status.name}, {plan.reason}")
                continue
            solved += 1
            refused += not planner.certify(plan).valid
            there = pose_at(planner.scene, plan.path[-1])
            off.append(
                float(np.linalg.norm(np.subtract(there.position, pose.position)))
            )
        median, p95 = np.percentile(1e3 * np.array(seconds), [50, 95])
        rows[name] = {
            "solved": solved,
            "of": len(problems),
            "interval": wilson(solved, len(problems)),
            "refused": refused,
            "ms": median,
            "ms_p95": p95,
            "farthest_m": max(off),
        }
        print(
            f"{name}: {solved} of {len(problems)} solved, {refused} refused, "
            f"{median:.1f} ms (p95 {p95:.1f}), at most {1e3 * max(off):.3f} mm off"
        )
    write_result(args.out, {"rows": rows, "quick": args.quick})
    print(f"written to {args.out}")


def pose_at(scene: Scene, q: np.ndarray) -> Pose:
    """Where C MuJoCo has the hand."""
    data = mujoco.MjData(scene.mj_model)
    data.qpos[:] = q
    mujoco.mj_kinematics(scene.mj_model, data)
    hand = data.body(scene.hand)
    return Pose(scene.hand, hand.xpos.copy(), hand.xquat.copy())


if __name__ == "__main__":
    run_script(main, Args)

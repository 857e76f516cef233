"""Planning problems that others are measured on: MotionBenchMaker, a cage, a table.

The robots are the Panda as spheres and the Fetch as 111, its torso's slide among its eight
joints. They come as MJCF text, so that MuJoCo's own checker and every peer see the geoms
that we see.

A part of MotionBenchMaker (Chamzas et al. 2021) lies in the repository, `eval/data`; more,
such as the Fetch, in the directory that `$JAXPLAN_MOTION_BENCH` names.
"""

import json
import os
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxplan.collision import Obstacle

HOME = (0, -0.785, 0, -2.356, 0, 1.571, 0.785)
"""Where the Panda rests [rad]: the start of all of its problems in MotionBenchMaker."""


class BenchProblem(NamedTuple):
    """From a start to a goal among obstacles."""

    set: str
    index: int
    """Its number in the set."""
    q_start: np.ndarray
    """`[d]` [rad or m]."""
    q_goal: np.ndarray
    """`[d]` [rad or m]."""
    obstacles: tuple[Obstacle, ...]


def data_directory() -> Path:
    """$JAXPLAN_MOTION_BENCH, by default what the repository has of it."""
    default = Path(__file__).parents[2] / "eval" / "data" / "motion_bench_maker"
    return Path(os.environ.get("JAXPLAN_MOTION_BENCH", default))


def read_robot(directory: str | os.PathLike, name: str = "panda") -> dict:
    """A robot's spheres, joints and pairs of links that are never checked.

    Raises:
        FileNotFoundError: The directory lacks its file, such as `panda_spheres.json`.
    """
    return _read(directory, f"{name}_spheres.json")


def read_problems(
    directory: str | os.PathLike, name: str = "panda"
) -> dict[str, list[BenchProblem]]:
    """The problems of each set, in its order, with the first of their goals.

    Raises:
        FileNotFoundError: The directory lacks its file, such as `panda_problems.json`.
    """
    sets = _read(directory, f"{name}_problems.json")["problems"]
    return {
        name: [
            _problem(name, p["index"], p["start"], p["goals"][0], _obstacles(p))
            for p in problems
        ]
        for name, problems in sets.items()
    }


def robot_mjcf(robot: dict, obstacles: str = "") -> str:
    """The robot as MJCF: its links by name, spheres for geoms; the Panda with a key frame `home`.

    Hand and fingers are welded to the last link, as the sphere models have them.

    Args:
        robot: What `read_robot` gives.
        obstacles: More XML for the world's body.
    """
    joints = defaultdict(list)
    for joint in robot["joints"]:
        joints[joint["parent"]].append(joint)

    def body(link: str, placed: str = "", moved: str = "") -> str:
        spheres = "".join(
            f'<geom size="{s["radius"]}" pos="{_row(s["position"])}"/>\n'
            for s in robot["links"][link]
        )
        below = "".join(
            body(
                j["child"],
                f' pos="{_row(j["xyz"])}" euler="{_row(j["rpy"])}"',
                "" if j["type"] == "fixed" else _joint(j),
            )
            for j in joints[link]
        )
        return f'<body name="{link}"{placed}>\n{moved}{spheres}{below}</body>\n'

    excluded = "".join(
        f'<exclude body1="{a}" body2="{b}"/>\n' for a, b in robot["disable_collisions"]
    )
    root = next(iter(set(robot["links"]) - {j["child"] for j in robot["joints"]}))
    moving = [joint for joint in robot["joints"] if joint["type"] != "fixed"]
    home = f'<key name="home" qpos="{_row(HOME)}"/>' if len(moving) == len(HOME) else ""
    # Capital XYZ: rpy turns about the axes of the parent, which stay where they are.
    return f"""<mujoco model="a robot as spheres">
<compiler angle="radian" eulerseq="XYZ"/>
<worldbody>
{body(root)}{obstacles}</worldbody>
<contact>
{excluded}</contact>
<keyframe>{home}</keyframe>
</mujoco>
"""


def obstacles_mjcf(obstacles: Iterable[Obstacle]) -> str:
    """Geoms at rest, for `robot_mjcf`."""
    return "".join(
        f'<geom name="{o.kind}{i}" type="{o.kind}" size="{_row(o.size)}" '
        f'pos="{_row(o.pose[:3])}" quat="{_row(o.pose[3:])}"/>\n'
        for i, o in enumerate(obstacles)
    )


def sphere_cage() -> BenchProblem:
    """VAMP's example: out of one gap between 14 spheres and into another."""
    low = [(0.55, 0), (0.35, 0.35), (0, 0.55), (-0.55, 0), (-0.35, -0.35)]
    low += [(0, -0.55), (0.35, -0.35)]
    high = [(0.35, 0.35), (0, 0.55), (-0.35, 0.35), (-0.55, 0), (-0.35, -0.35)]
    high += [(0, -0.55), (0.35, -0.35)]
    centres = [(*xy, 0.25) for xy in low] + [(*xy, 0.8) for xy in high]
    spheres = [_obstacle("sphere", [0.2], centre) for centre in centres]
    goal = (2.35, 1, 0, -0.8, 0, 2.5, 0.785)
    return _problem("sphere_cage", 0, HOME, goal, spheres)


def table() -> BenchProblem:
    """From over a cup into the box, with a block in between."""
    obstacles = [
        _obstacle("box", [0.3, 0.5, 0.02], [0.6, 0, 0.1]),  # table top
        _obstacle("box", [0.12, 0.12, 0.005], [0.55, -0.3, 0.125]),  # floor of the box
        _obstacle("box", [0.005, 0.12, 0.06], [0.425, -0.3, 0.18]),  # and its walls
        _obstacle("box", [0.005, 0.12, 0.06], [0.675, -0.3, 0.18]),
        _obstacle("box", [0.13, 0.005, 0.06], [0.55, -0.425, 0.18]),
        _obstacle("box", [0.13, 0.005, 0.06], [0.55, -0.175, 0.18]),
        _obstacle("box", [0.05, 0.05, 0.2], [0.55, 0, 0.32]),  # block
        _obstacle("capsule", [0.04, 0.03], [0.55, 0.3, 0.19]),  # cup
    ]
    start = (0.31, 0.28, 0.21, -1.82, -0.07, 2.1, 0.78)
    goal = (-0.32, 0.38, -0.19, -1.9, 0.09, 2.27, 0.79)
    return _problem("table", 0, start, goal, obstacles)


def _read(directory: str | os.PathLike, name: str) -> dict[str, Any]:
    file = Path(directory) / name
    if not file.is_file():
        raise FileNotFoundError(
            f"no {name} in {str(directory)!r}: set JAXPLAN_MOTION_BENCH to its directory"
        )
    return json.loads(file.read_text(encoding="utf-8"))


def _obstacles(problem: dict) -> list[Obstacle]:
    sizes = {
        "box": lambda geom: geom["half_extents"],
        "cylinder": lambda geom: [geom["radius"], geom["length"] / 2],
        "sphere": lambda geom: [geom["radius"]],
    }
    return [
        _obstacle(kind, size(geom), geom["position"], geom["orientation_quat_xyzw"])
        for kind, size in sizes.items()
        for geom in problem[kind]
    ]


def _obstacle(
    kind: str,
    size: Iterable[float],
    position: Iterable[float],
    xyzw: Iterable[float] = (0, 0, 0, 1),
) -> Obstacle:
    x, y, z, w = xyzw
    return Obstacle(kind, [*size], [*position, w, x, y, z])


def _problem(
    name: str,
    index: int,
    start: Iterable[float],
    goal: Iterable[float],
    obstacles: Iterable[Obstacle],
) -> BenchProblem:
    q_start, q_goal = np.array([start, goal], float)
    return BenchProblem(name, index, q_start, q_goal, tuple(obstacles))


def _joint(joint: dict) -> str:
    kind = {"revolute": "hinge", "prismatic": "slide"}[joint["type"]]
    axis, limits = _row(joint["axis"]), _row(joint["limit"])
    name = joint["name"]
    return f'<joint name="{name}" type="{kind}" axis="{axis}" range="{limits}"/>\n'


def _row(numbers: Iterable[float]) -> str:
    """Numbers as an attribute has them."""
    return " ".join(map(str, numbers))

"""What the peers have in common: the scene as C MuJoCo checks it fastest, and who is here.

Peers come from the extra `bench`; what is not installed is reported, not raised.
"""

from collections import Counter
from collections.abc import Iterable
from importlib.metadata import version
from importlib.util import find_spec
from typing import NamedTuple

import mujoco
import numpy as np

from jaxplan.collision import Obstacle
from jaxplan.evaluation.motion_bench import BenchProblem, obstacles_mjcf, robot_mjcf

PACKAGES = "ompl", "pybullet", "torch"


class Planned(NamedTuple):
    """What a planner answered."""

    solved: bool
    status: str
    """In the planner's own words."""
    path: np.ndarray
    """`[n, 7]` waypoints [rad]; n = 0 without a solution."""
    checks: int
    """Configurations that were checked."""
    seconds: float


def absent(package: str) -> str | None:
    """Why a peer has no figures, for its row; None if it is installed."""
    if find_spec(package):
        return None
    return f"{package} is not installed (pip install 'jaxplan[bench]')"


def peer_model(robot: dict, obstacles: Iterable[Obstacle]) -> mujoco.MjModel:
    """The Panda among obstacles, laid out for C MuJoCo's speed.

    With a body for each obstacle the broad phase rejects them one by one, and then the
    trees of bounds within bodies only cost: 1.1 to 1.8 times faster than geoms of the
    world, with the same verdicts.
    """
    geoms = obstacles_mjcf(obstacles).splitlines()
    bodies = "".join(f"<body>{geom}</body>\n" for geom in geoms)
    model = mujoco.MjModel.from_xml_string(robot_mjcf(robot, bodies))
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
    return model


def slots_for(problems: Iterable[BenchProblem]) -> dict[str, int]:
    """Room for the obstacles of any of the problems, as `Scene.from_mjcf` takes it."""
    slots: Counter[str] = Counter()
    for problem in problems:
        slots |= Counter(obstacle.kind for obstacle in problem.obstacles)
    return dict(slots)


def peer_versions() -> dict[str, str]:
    """Of the peers that are installed."""
    here = [package for package in PACKAGES if not absent(package)]
    return {package: version(package) for package in here}

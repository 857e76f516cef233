"""Motions among sheets of 1 mm: what C MuJoCo says of paths, and of what is made of them.

    python eval/motions.py --out runs/motions.json

A small arm of spheres moves between the boards of a shelf, through thin sheets and around a
grid of plates. Each path and the motion that `Planner.time` makes of it are checked by C
MuJoCo, at 0.002 rad and 1 mm. A sheet is thinner than what the arm moves between two
checked configurations, so that checks of points alone would miss some.
"""

import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jaxplan import Obstacle, Plan, Planner, Scene, make_world
from jaxplan.cli import run_script
from jaxplan.collision import clearance_mujoco
from jaxplan.collision.touching import random_poses
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Count, NotNegative, Positive

ARM = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default><joint axis="0 1 0" range="-2.4 2.4"/><geom type="sphere"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <body name="shoulder" pos="0 0 0.3">
      <joint name="turn" axis="0 0 1" range="-3 3"/>
      <geom name="drum" size="0.06"/>
      <body name="upper_arm" pos="0 0 0.05">
        <joint name="lift"/>
        <geom name="upper_0" size="0.04" pos="0 0 0.1"/>
        <geom name="upper_1" size="0.03" pos="0 0 0.2"/>
        <body name="forearm" pos="0 0 0.28">
          <joint name="elbow"/>
          <geom name="fore_0" size="0.03" pos="0 0 0.08"/>
          <geom name="fore_1" size="0.022" pos="0 0 0.16"/>
          <body name="hand" pos="0 0 0.22">
            <joint name="wrist"/>
            <joint name="swing" axis="1 0 0"/>
            <geom name="palm" size="0.022" pos="0 0 0.03"/>
            <geom name="tip" size="0.012" pos="0 0 0.08"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
THIN = 0.0005
"""Half of a sheet [m]."""
SHEETS = 12
"""In a scene at most."""
APART = 0.005
"""Clearance of starts and goals at least [m]."""
BATCH = 64


@dataclass(frozen=True)
class Args(Checked):
    """Plans and times motions in each scene, and has C MuJoCo check them."""

    out: Path = Path("runs/motions.json")
    problems: Count = 350
    """A scene."""
    resolution: Positive = 0.002
    """Of the certificates [rad]."""
    tolerance: NotNegative = 0.001
    """Penetration that still passes [m]."""
    quick: bool = False
    """20 problems a scene."""


@dataclass
class Row:
    """What came of a scene's problems."""

    scene: str
    problems: int = 0
    solved: int = 0
    paths_refused: int = 0
    motions_refused: int = 0
    not_free: int = 0
    """Motions that `time` itself calls unsafe."""
    deepest: float = 0.0
    """Of motions, by C MuJoCo [m]."""
    milliseconds: float = 0.0
    """Median of `Planner.time`."""


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    planner = Planner(Scene.from_mjcf(ARM, slots={"box": SHEETS}))
    problems = 20 if args.quick else args.problems
    rows = [survey(planner, name, problems, args) for name in SCENES]
    show(rows)
    settings = asdict(args) | {"out": str(args.out)}
    result = {
        "rows": [asdict(row) for row in rows],
        "settings": settings,
    }
    write_result(args.out, result)
    print(f"written to {args.out}")


def survey(planner: Planner, name: str, problems: int, args: Args) -> Row:
    """Asks a scene's problems."""
    row, seconds = Row(name), []
    for plan in tqdm(solved(planner, name, problems, row), name, problems):
        began = time.perf_counter()
        timed = planner.time(plan)
        seconds.append(time.perf_counter() - began)
        row.not_free += not timed.free
        check = plan.world, args.resolution, args.tolerance
        row.paths_refused += not planner.certify(plan, *check).valid
        verdict = planner.certify(timed.q, *check)
        row.motions_refused += not verdict.valid
        row.deepest = max(row.deepest, -verdict.clearance)
    row.milliseconds = 1000 * float(np.median(seconds))
    return row


def solved(planner: Planner, name: str, problems: int, row: Row) -> Iterator[Plan]:
    """The plans of a scene's problems that have a path; counts them."""
    world = make_world(planner.scene, obstacles=SCENES[name])
    q = random_poses(planner.scene, 8 * problems)
    q = q[clearance_mujoco(planner.scene, world, q) > APART][: 2 * problems]
    starts, goals = q[::2], q[1::2]
    for first in range(0, len(starts), BATCH):
        rows = slice(first, first + BATCH)
        seeds = list(range(first, first + len(starts[rows])))
        for plan in planner.plan_batch(starts[rows], goals[rows], seeds, world):
            row.problems += 1
            row.solved += plan.solved
            if plan.solved:
                yield plan


def show(rows: list[Row]) -> None:
    """Prints the table."""
    print(
        "scene     problems solved  refused: paths motions  unsafe  deepest       time"
    )
    for row in rows:
        print(
            f"{row.scene:9s} {row.problems:9d} {row.solved:6d} {row.paths_refused:15d} "
            f"{row.motions_refused:7d} {row.not_free:7d} {1000 * row.deepest:5.2f} mm "
            f"{row.milliseconds:7.1f} ms"
        )


def _sheet(
    size: tuple[float, float, float], position: tuple[float, float, float], *turn: float
) -> Obstacle:
    return Obstacle("box", size, (*position, *turn))


def _shelf() -> list[Obstacle]:
    """Four boards and four sides."""
    boards = [_sheet((0.15, 0.3, THIN), (0.42, 0, z)) for z in (0.12, 0.32, 0.52, 0.72)]
    sides = [_sheet((0.15, THIN, 0.3), (0.42, y, 0.42)) for y in (-0.3, -0.1, 0.1, 0.3)]
    return boards + sides


def _thin_sheets() -> list[Obstacle]:
    """Turned at random, all around."""
    rng = np.random.default_rng(1)
    sheets = []
    for angle in np.linspace(0, 2 * np.pi, SHEETS, endpoint=False):
        away, height = rng.uniform(0.25, 0.45), rng.uniform(0.25, 0.75)
        turn = rng.normal(size=4)
        turn /= np.linalg.norm(turn)
        place = away * np.cos(angle), away * np.sin(angle), height
        sheets.append(_sheet((0.12, 0.12, THIN), place, *turn))
    return sheets


def _plates() -> list[Obstacle]:
    """Two rows of five, as the spokes of a wheel, and a lid."""
    plates = [_sheet((0.5, 0.5, THIN), (0, 0, 0.9))]
    for angle in np.linspace(-1, 1, 5):
        turn = np.cos(angle / 2), 0, 0, np.sin(angle / 2)
        for height in (0.35, 0.65):
            place = 0.4 * np.cos(angle), 0.4 * np.sin(angle), height
            plates.append(_sheet((0.1, THIN, 0.12), place, *turn))
    return plates


SCENES = {"shelf": _shelf(), "sheets": _thin_sheets(), "plates": _plates()}


if __name__ == "__main__":
    run_script(main, Args)

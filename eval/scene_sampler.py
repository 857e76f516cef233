"""A learned sampler of a scene: the same planner with it, and without it.

    python eval/scene_sampler.py --out runs/scene_sampler.json
    python eval/scene_sampler.py --cell docs/arm.xml --description docs/cell.json

By default on MotionBenchMaker's problems. Every second problem of each set is varied
(`parts/variations.py`) and the variations are solved, several ways each; samplers learn from
these paths. The other problems are then asked of the planner with each sampler and without, in
turns. With `--cell`, problems are drawn from a description, and others of it are asked.

Also with obstacles of another problem told to the sampler: what it proposes is then wrong, and
problems are solved all the same. Recording and training resume where they were stopped.
"""

import dataclasses
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np
from parts.variations import vary
from peers import slots_for
from pose_goals import pose_at
from tqdm import tqdm

from jaxplan import Plan, Planner, Scene, cells, make_world, train
from jaxplan.cells import CellRecorder, Problem, RecordConfig
from jaxplan.cli import run_script
from jaxplan.collision import World
from jaxplan.evaluation.motion_bench import (
    BenchProblem,
    data_directory,
    read_problems,
    read_robot,
    robot_mjcf,
)
from jaxplan.evaluation.result import write_result
from jaxplan.evaluation.tables import Table, markdown
from jaxplan.motion.sampling import Proposals, Sampler
from jaxplan.pretrained import load_sampler
from jaxplan.ranges import Checked, Count

WITHOUT = "none"
WRONG = "few_step, another problem's obstacles"
NETWORKS = ("few_step", "sampler", "cvae")
AIMED = {"cage": 0.5, "box": 0.5, "all": 0.8}
"""Expansions with `few_step` to those without a sampler, by set."""


@dataclass(frozen=True)
class Args(Checked):
    """Records, trains, and asks each problem that was kept aside."""

    out: Path = Path("runs/scene_sampler.json")
    cell: Path | None = None
    """An MJCF; None: the Panda among MotionBenchMaker's problems."""
    description: Path | None = None
    """Of the cell's problems, see `jaxplan.cells.description`."""
    data: Path = field(default_factory=data_directory)
    """Directory with the robots' spheres and MotionBenchMaker's problems."""
    work: Path = Path("runs/scene_sampler")
    """Directory of recorded paths and weights."""
    problems: Count = 3072
    """That are recorded."""
    steps: Count = 5000
    """Of training; half as many for `few_step`."""
    seeds: Count = 3
    """Searches of each problem."""
    record: RecordConfig = RecordConfig()
    quick: bool = False
    """64 recorded problems, 50 steps, 2 problems a set."""


class Ground(NamedTuple):
    """Where a sampler is tried."""

    scene: Scene
    recorded: Callable[[Planner], Callable[[int], Problem]]
    """Problems by number that it learns from."""
    kept: Callable[[Planner], dict[str, list[Problem]]]
    """Problems that it is asked, set by set."""
    facts: dict[str, Any]


def main(args: Args) -> None:
    """Measures, prints a table, writes JSON."""
    if args.quick:
        quick = dataclasses.replace(args.record, ways=1, shard_size=32)
        args = dataclasses.replace(
            args, problems=64, steps=50, seeds=1, record=quick, work=args.work / "quick"
        )
    ground = motion_bench(args) if args.cell is None else cell(args)
    learn(args, ground)
    found = ask(args, ground)
    rows = {name: summary(sides) for name, sides in found.items()}
    every = {
        side: [p for sides in found.values() for p in sides[side]]
        for side in (WITHOUT, *NETWORKS, WRONG)
    }
    rows["all"] = summary(every)
    tables = [table(name, sides) for name, sides in rows.items()]
    for each in tables:
        print(f"\n{each.title}\n{markdown(each)}")
    settings = dataclasses.asdict(args.record) | {
        name: getattr(args, name) for name in ("problems", "steps", "seeds")
    }
    write_result(
        args.out,
        {
            "rows": rows,
            "tables": [dataclasses.asdict(each) for each in tables],
            "shortfalls": short_of_aim(rows),
            **ground.facts,
            "settings": settings,
            "quick": args.quick,
        },
    )
    print(f"written to {args.out}")


def motion_bench(args: Args) -> Ground:
    """The Panda's sets: every second problem is varied, the others are kept."""
    robot, every = read_robot(args.data), read_problems(args.data)
    problems = [problem for some in every.values() for problem in some]
    scene = Scene.from_mjcf(robot_mjcf(robot), slots=slots_for(problems))
    shown = [problem for some in every.values() for problem in some[::2]]

    def recorded(planner: Planner) -> Callable[[int], Problem]:
        hands = [pose_at(scene, problem.q_goal) for problem in shown]

        def pose(number: int) -> Problem:
            row = number % len(shown)
            return vary(planner, hands[row], shown[row], [args.record.seed, number])

        return pose

    def kept(planner: Planner) -> dict[str, list[Problem]]:
        def problem(p: BenchProblem) -> Problem:
            return Problem(
                p.q_start, p.q_goal, make_world(scene, obstacles=p.obstacles)
            )

        most = 2 if args.quick else None
        return {
            name: [*map(problem, some[1::2][:most])] for name, some in every.items()
        }

    return Ground(scene, recorded, kept, {"varied": len(shown)})


def cell(args: Args) -> Ground:
    """A cell of one's own, as it is described."""
    given = {} if args.description is None else cells.read_json(args.description)
    scene = Scene.from_mjcf(str(args.cell), slots=cells.slots_needed(given))
    seed, count = args.record.seed, 2 if args.quick else 100

    def recorded(planner: Planner) -> Callable[[int], Problem]:
        return partial(cells.Cell(planner, given).draw, seed)

    def kept(planner: Planner) -> dict[str, list[Problem]]:
        draw = cells.Cell(planner, given).draw
        return {"cell": [draw(seed + 1, number) for number in range(count)]}

    return Ground(scene, recorded, kept, {"description": given})


def learn(args: Args, ground: Ground) -> None:
    """Records problems and trains every sampler on their paths."""
    planner = Planner(ground.scene, args.record.planner)
    paths, weights = args.work / "paths", args.work / "weights"
    recorder = CellRecorder(planner, ground.recorded(planner), args.record)
    cells.record(paths, args.problems, recorder, ground.facts)
    common = ["--data", str(paths), "--out", str(weights)]
    for network in ("sampler", "few_step", "cvae"):
        steps = args.steps // 2 if network == "few_step" else args.steps
        more = ["--teacher", str(weights)] if network == "few_step" else []
        name = f"{args.work.name}_{network}_{steps}"
        code = train.main(
            [f"scene_{network}", *common, "--name", name, "--steps", str(steps), *more]
        )
        if code:
            raise RuntimeError(f"scene_{network} was not trained")


def ask(args: Args, ground: Ground) -> dict[str, dict[str, list[Plan]]]:
    """Each problem of each planner, which take turns."""
    samplers: dict[str, Sampler | None] = {WITHOUT: None}
    samplers |= {n: load_sampler(args.work / "weights", n) for n in NETWORKS}
    kept = ground.kept(Planner(ground.scene))
    others = [some[row].world for some in kept.values() for row in (0, 1)]
    samplers[WRONG] = Mistaken(load_sampler(args.work / "weights", "few_step"), others)
    sides = {name: Planner(ground.scene, sampler=s) for name, s in samplers.items()}
    found: dict[str, dict[str, list[Plan]]] = {}
    for planner in sides.values():  # compiles
        first = next(iter(kept.values()))[0]
        planner.plan(first.q_start, first.goal, 0, first.world)
    for name, problems in kept.items():
        found[name] = {side: [] for side in sides}
        asked = [(problem, seed) for seed in range(args.seeds) for problem in problems]
        for problem, seed in tqdm(asked, desc=name, unit="problem"):
            for side, planner in sides.items():
                began = time.perf_counter()
                plan = planner.plan(problem.q_start, problem.goal, seed, problem.world)
                seconds = time.perf_counter() - began
                found[name][side].append(dataclasses.replace(plan, time=seconds))
    refuse_untrue(sides[WITHOUT], found)
    return found


def refuse_untrue(
    planner: Planner, found: Mapping[str, Mapping[str, list[Plan]]]
) -> None:
    """Every path is C MuJoCo's too."""
    for name, sides in found.items():
        for side, plans in sides.items():
            for plan in plans:
                if plan.solved and not planner.certify(plan).valid:
                    raise RuntimeError(f"{name}, {side}: a path that C MuJoCo refuses")


class Mistaken:
    """A sampler that is told of obstacles which are not there."""

    def __init__(self, sampler: Sampler, worlds: list[World]) -> None:
        self._sampler, self._worlds = sampler, worlds

    def for_scene(self, scene: Scene) -> Proposals:
        """Proposals for the next of its worlds in turn."""
        proposals, turn = self._sampler.for_scene(scene), cycle(self._worlds)

        def wrong(q_start: Any, q_goal: Any, keys: jax.Array, world: World) -> Any:
            told = next(turn)
            same = np.array_equal(told.slot_pose, world.slot_pose)
            return proposals(q_start, q_goal, keys, self._worlds[0] if same else told)

        return wrong


def summary(found: Mapping[str, list[Plan]]) -> dict[str, dict[str, float]]:
    """Figures of each side; ratios of means, and of times, to the planner without."""
    rows = {}
    for side, plans in found.items():
        seconds = np.array([plan.time for plan in plans])
        rows[side] = {
            "solved": sum(plan.solved for plan in plans),
            "of": len(plans),
            "expansions": float(np.mean([plan.expansions for plan in plans])),
            "expansions_median": float(np.median([plan.expansions for plan in plans])),
            "checks": float(np.mean([plan.checks for plan in plans])),
            "length": float(np.median([plan.length for plan in plans])),
            "ms": 1e3 * float(np.median(seconds)),
            "ms_p95": 1e3 * float(np.quantile(seconds, 0.95)),
        }
    for side, row in rows.items():
        for name in ("expansions", "checks", "ms", "ms_p95"):
            rows[side][f"{name}_ratio"] = row[name] / rows[WITHOUT][name]
    return rows


def table(name: str, sides: Mapping[str, Mapping[str, float]]) -> Table:
    """Of one set of problems."""
    columns = [
        "sampler",
        "solved",
        "expansions",
        "to none",
        "median",
        "checks to none",
        "path [rad]",
        "median [ms]",
        "to none",
        "p95 [ms]",
        "to none",
    ]
    rows = [
        [
            side,
            f"{row['solved']} of {row['of']}",
            row["expansions"],
            row["expansions_ratio"],
            row["expansions_median"],
            row["checks_ratio"],
            row["length"],
            row["ms"],
            row["ms_ratio"],
            row["ms_p95"],
            row["ms_p95_ratio"],
        ]
        for side, row in sides.items()
    ]
    return Table(name, columns, rows)


def short_of_aim(rows: Mapping[str, Mapping[str, Mapping[str, float]]]) -> list[str]:
    """Where `few_step` is not as much better than none as we want it to be."""
    found = []
    for name, sides in rows.items():
        row = sides["few_step"]
        for what, words, most in (
            ("expansions_ratio", "expansions", AIMED.get(name, 1.0)),
            ("ms_ratio", "median time", 1.1),
        ):
            if row[what] > most:
                found.append(f"{name}: {words} {row[what]:.2f} of none (aim {most})")
    return found


if __name__ == "__main__":
    run_script(main, Args)

"""Relabelled closed-loop states: `python train/relabel.py --out data/mug_relabelled`.

The networks drive; at each phase's start the expert says what it would have done (one round of
DAgger). Resumes shard by shard, as `collect_demos.py` does.
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from jaxplan import data, tasks
from jaxplan.algorithm1 import Algorithm1
from jaxplan.cli import run_script
from jaxplan.demonstrations import Relabeler
from jaxplan.episodes import run_episodes
from jaxplan.learned import learned
from jaxplan.motion import MotionPlanner
from jaxplan.pretrained import load_pair, shipped
from jaxplan.ranges import Checked, Count, Whole
from jaxplan.tasks.perturbation import NOMINAL, Perturbation


@dataclass(frozen=True)
class Args(Checked):
    """What to collect."""

    out: Path = Path("data/mug_relabelled")
    weights: Path | None = None
    """Directory with the networks that drive; those that are shipped for the variant where None."""
    episodes: Count = 256
    first_seed: Whole = 50_000
    shard_size: Count = 32
    camera: str = "hand"
    task: str = tasks.DEFAULT
    variant: str = "plain"
    perturbation: Perturbation = NOMINAL
    """What varies in the pictures."""
    objects: str = tasks.ONE
    """Which objects the episodes have: one, train, held_out."""


def main(args: Args) -> None:
    """Collects what is missing."""
    name = tasks.check(args.task, args.variant, args.objects)
    robot = tasks.TASKS[args.task].robot
    weights = load_pair(args.weights or shipped(args.variant))
    for network in weights:
        network.check_fits(name, args.camera, robot)
    settings = dataclasses.asdict(args) | {
        "task": name,
        "robot": robot,
        "out": None,
        "episodes": None,
        "weights": [entry.info["sha256"] for entry in weights],
    }
    args.out.mkdir(parents=True, exist_ok=True)
    count = -(-args.episodes // args.shard_size)
    missing = data.missing_shards(args.out, count, settings)
    data.write_manifest(args.out, settings)
    task = tasks.load(
        args.task,
        args.shard_size,
        args.variant,
        args.camera,
        perturbation=args.perturbation,
        objects=args.objects,
    )
    planner = MotionPlanner(task.planning_scene, task.robot.limits)
    agent = Algorithm1(task, planner, *learned(task, weights))
    bar = tqdm(missing, unit="shard")
    for index in bar:
        first = args.first_seed + index * args.shard_size
        seeds = range(first, first + args.shard_size)
        relabeler = Relabeler(task, seeds)
        records = run_episodes(task, agent, seeds, listeners=[relabeler])
        data.write_shard(data.shard_path(args.out, index), relabeler.shard(records))
        bar.set_postfix_str(
            f"{sum(r.success for r in records)}/{len(records)} succeeded"
        )
    data.write_manifest(args.out, settings)


if __name__ == "__main__":
    run_script(main, Args)

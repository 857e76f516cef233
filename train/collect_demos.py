"""Collects demonstrations: `python train/collect_demos.py --episodes 2000 --out data/mug`.

Shards are written one by one and are byte-identical however often the run is killed and begun
again; a finished collection has a manifest with the checksum of each.
"""

import dataclasses
import sys
from dataclasses import dataclass
from pathlib import Path

import tyro
from tqdm import tqdm

from jaxplan import config, data
from jaxplan.motion import MotionPlanner
from jaxplan.rollout import Targets, rollout
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.tasks.mug.demonstrate import ExpertPolicy, Recorder
from jaxplan.tasks.mug.task import MugTask


@dataclass(frozen=True)
class Args:
    """What to collect."""

    out: Path = Path("data/mug")
    episodes: int = 2000
    first_seed: int = 0
    shard_size: int = 32
    """Episodes a shard; one batch in lockstep."""
    camera: str = "hand"
    demonstration: config.DemonstrationConfig = config.DemonstrationConfig()


def main(args: Args) -> None:
    """Collects what is missing."""
    if args.episodes < 1 or args.shard_size < 1:
        raise ValueError(f"nothing to collect: episodes {args.episodes}, shard_size {args.shard_size}")
    count = -(-args.episodes // args.shard_size)
    settings = {
        "task": "mug", "first_seed": args.first_seed, "shard_size": args.shard_size, "camera": args.camera,
        "demonstration": dataclasses.asdict(args.demonstration),
    }  # fmt: skip
    args.out.mkdir(parents=True, exist_ok=True)
    missing = data.missing_shards(args.out, count, settings)
    if missing:
        data.write_manifest(args.out, settings)
        task = MugTask(args.shard_size, args.camera)
        planner = MotionPlanner(task.planning_scene, PANDA_LIMITS, config.PlannerConfig(p_uniform=1.0))
        policy = ExpertPolicy(task, args.demonstration)
    done = solved = 0
    bar = tqdm(missing, unit="shard")
    for index in bar:
        seeds = [args.first_seed + index * args.shard_size + k for k in range(args.shard_size)]
        policy.reset(seeds)
        recorder = Recorder(task, policy, seeds, args.demonstration)
        records = rollout(task, seeds, lambda o, e: Targets(*policy(o, e)), planner, listen=recorder)
        data.write_shard(data.shard_path(args.out, index), recorder.shard(records))
        done, solved = done + len(seeds), solved + sum(record.success for record in records)
        bar.set_postfix_str(f"{solved}/{done} episodes solved, {done / bar.format_dict['elapsed']:.2f} episodes/s")
    data.write_manifest(args.out, settings)


if __name__ == "__main__":
    try:
        main(tyro.cli(Args))
    except (ValueError, RuntimeError) as error:
        sys.exit(f"error: {error}") if False else (print(f"error: {error}", file=sys.stderr), sys.exit(2))

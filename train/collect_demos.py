"""Collects demonstrations: `python train/collect_demos.py --episodes 2000 --out data/mug`.

Shards are written one by one and are byte-identical however often the run is killed and begun
again; a finished collection has a manifest with the checksum of each, and a card (`CARD.md`) that
says what is in it. With `--timed` the same episodes are kept whole, a frame each 100 ms with the
expert's action: what policies learn from.
"""

import dataclasses
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

from card import write_card
from tqdm import tqdm

from jaxplan import data, tasks
from jaxplan.cli import run_script
from jaxplan.demonstrations import (
    DemonstrationConfig,
    ExpertAgent,
    Recorder,
    TimedRecorder,
)
from jaxplan.episodes import run_episodes
from jaxplan.ranges import Checked, Count, Whole
from jaxplan.tasks.perturbation import NOMINAL, Perturbation


@dataclass(frozen=True)
class Args(Checked):
    """What to collect."""

    out: Path = Path("data/mug")
    episodes: Count = 2000
    first_seed: Whole = 0
    shard_size: Count = 32
    """Episodes a shard; one batch in lockstep."""
    timed: bool = False
    """Whole episodes at an even pace, for policies."""
    camera: str = "hand"
    task: str = tasks.DEFAULT
    variant: str = "plain"
    workers: Count = field(default_factory=lambda: os.cpu_count() or 1)
    """Processes, each making one shard at a time. The bytes do not depend on it."""
    perturbation: Perturbation = NOMINAL
    """What varies in the pictures."""
    objects: str = tasks.ONE
    """Which objects the episodes have: one, train, held_out."""
    demonstration: DemonstrationConfig = DemonstrationConfig()


class Collector:
    """Makes shards in a process of its own."""

    def __init__(self, args: Args) -> None:
        self._args = args
        self._task = tasks.load(
            args.task,
            args.shard_size,
            args.variant,
            args.camera,
            perturbation=args.perturbation,
            objects=args.objects,
        )
        self._expert = ExpertAgent(self._task, args.demonstration)

    def shard(self, index: int) -> tuple[int, int]:
        """Makes and writes shard `index`; returns how many episodes succeeded, and of how many."""
        args, task, expert = self._args, self._task, self._expert
        first = args.first_seed + index * args.shard_size
        seeds = range(first, first + args.shard_size)
        recorder = (
            TimedRecorder(task, expert, seeds)
            if args.timed
            else Recorder(task, expert, seeds, args.demonstration)
        )
        records = run_episodes(task, expert, seeds, listeners=[recorder])
        data.write_shard(data.shard_path(args.out, index), recorder.shard(records))
        return sum(record.success for record in records), len(records)


_collector: Collector | None = None


def _start(args: Args) -> None:
    global _collector
    _collector = Collector(args)


def _shard(index: int) -> tuple[int, int]:
    assert _collector is not None
    return _collector.shard(index)


def main(args: Args) -> None:
    """Collects what is missing."""
    count = -(-args.episodes // args.shard_size)
    if not 0 <= args.first_seed <= 2**31 - count * args.shard_size:
        raise ValueError(f"first_seed {args.first_seed}: seeds are 0 to {2**31 - 1}")
    settings = {
        "task": tasks.check(args.task, args.variant, args.objects),
        "robot": tasks.TASKS[args.task].robot,
        "first_seed": args.first_seed,
        "shard_size": args.shard_size,
        "camera": args.camera,
        "perturbation": dataclasses.asdict(args.perturbation),
        "objects": args.objects,
        "demonstration": dataclasses.asdict(args.demonstration),
    }
    if args.timed:
        settings["frame_period"] = data.FRAME_PERIOD
    args.out.mkdir(parents=True, exist_ok=True)
    missing = data.missing_shards(args.out, count, settings)
    data.write_manifest(args.out, settings)
    if missing:
        _collect(args, missing)
        data.write_manifest(args.out, settings)
    write_card(args.out)


def _collect(args: Args, missing: list[int]) -> None:
    """Makes shards in parallel, with a progress bar."""
    spawn = multiprocessing.get_context("spawn")
    workers = min(args.workers, len(missing))
    solved = made = 0
    with (
        ProcessPoolExecutor(workers, spawn, _start, (args,)) as pool,
        tqdm(total=len(missing) * args.shard_size, unit="episode") as bar,
    ):
        for done in as_completed([pool.submit(_shard, index) for index in missing]):
            successes, episodes = done.result()
            solved, made = solved + successes, made + episodes
            bar.update(episodes)
            bar.set_postfix_str(f"{solved}/{made} succeeded")


if __name__ == "__main__":
    run_script(main, Args)

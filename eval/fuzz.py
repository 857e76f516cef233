"""Random scenes, whole problems: what raises, and what C MuJoCo refuses.

    XLA_FLAGS=--xla_backend_optimization_level=0 python eval/fuzz.py --scenes 300 --seed 0

Nearly all of the time is compilation, which the flag makes shorter. Each scene's outcome is
a line in `--out`; those that are there already are not asked again.
"""

import json
import time
import traceback
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import jax
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.evaluation.fuzzing import Judged, interrogate, worlds_of
from jaxplan.evaluation.random_scenes import random_scene
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked, Count, Whole


@dataclass(frozen=True)
class Args(Checked):
    """Asks whole problems in random scenes, and has C MuJoCo judge the answers."""

    out: Path = Path("runs/fuzz.jsonl")
    """A scene a line; beside it, with the suffix .json, the summary."""
    scenes: Count = 300
    seed: Whole = 0
    """Of the first."""
    stride: Count = 1
    """From one scene's seed to the next: so that processes can share the work."""
    worlds: Whole = 1
    """Random ones in each scene, besides the model's own."""


def main(args: Args) -> None:
    """Asks, prints faults, writes JSON."""
    args.out.parent.mkdir(parents=True, exist_ok=True)
    done = {row["seed"] for row in _rows(args.out)}
    seeds = range(args.seed, args.seed + args.scenes, args.stride)
    for seed in tqdm([s for s in seeds if s not in done], unit="scene"):
        row = asked(seed, args.worlds)
        for fault in row["faults"]:
            tqdm.write(f"{seed}: {fault}")
        with args.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        jax.clear_caches()
    summary = summed([row for row in _rows(args.out) if row["seed"] in seeds])
    summary |= {"worlds": args.worlds + 1}
    write_result(args.out.with_suffix(".json"), summary)
    print(json.dumps(summary, indent=1))


def asked(seed: int, worlds: int) -> dict:
    """A scene's row."""
    began = time.perf_counter()
    row: dict = {"seed": seed, "refused": ""}
    judged = Judged()
    try:
        drawn = random_scene(seed)
        row |= {"joints": len(drawn.joints), "slots": drawn.slots}
        scene = drawn.read()
        judged = interrogate(scene, seed, worlds_of(scene, seed, worlds))
    except ValueError as error:
        row["refused"] = str(error)
    except Exception:
        judged.faults.append(traceback.format_exc())
    counted = {"statuses": dict(judged.statuses), "counts": dict(judged.counts)}
    seconds = round(time.perf_counter() - began, 1)
    return row | {"faults": judged.faults} | counted | {"seconds": seconds}


def summed(rows: list[dict]) -> dict:
    """Counts over all scenes."""
    statuses, counts = Counter(), Counter()
    for row in rows:
        statuses.update(row["statuses"])
        counts.update(row["counts"])
    return {
        "scenes": len(rows),
        "refused": dict(Counter(row["refused"] for row in rows if row["refused"])),
        "faults": {str(row["seed"]): row["faults"] for row in rows if row["faults"]},
        "statuses": dict(statuses),
        "counts": dict(counts),
    }


def _rows(path: Path) -> list[dict]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    run_script(main, Args)

"""Speed, side by side: ours and its peers in one run on one machine.

    python eval/benchmark.py --out runs/benchmark.json
    python eval/benchmark.py --quick --parts collision --gate

Parts: collision queries, planning, learned proposals, compilation. Sides take turns, so
that a busy machine slows all of them alike; what counts is the ratio. A peer that is not
installed is a row that says so (pip install 'jaxplan[bench]' has them all).

`--gate` compares the ratios with the committed ones and exits 1 on a regression.
"""

import json
import os
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import jax
from parts import collision_speed, compile_time, planning_speed, proposal_speed
from parts.gate import judge, merge
from parts.rows import Part, show
from peers import peer_versions

from jaxplan.cli import run_script
from jaxplan.evaluation import versions
from jaxplan.evaluation.motion_bench import data_directory
from jaxplan.evaluation.result import write_result
from jaxplan.ranges import Checked

Name = Literal["collision", "planning", "proposals", "compile"]
PARTS = {
    "collision": collision_speed.measure,
    "planning": planning_speed.measure,
    "proposals": proposal_speed.measure,
    "compile": compile_time.measure,
}
BASELINE = Path(__file__).parent / "results" / "benchmark.json"


@dataclass(frozen=True)
class Args(Checked):
    """Measures speed against MuJoCo, OMPL, PyBullet and PyTorch."""

    parts: tuple[Name, ...] = ("collision", "planning", "proposals", "compile")
    quick: bool = False
    """Fewer rounds, and without what takes long."""
    out: Path = Path("runs/benchmark.json")
    data: Path = field(default_factory=data_directory)
    """Directory with the Panda's spheres and MotionBenchMaker's problems."""
    gate: bool = False
    """Compares with the baseline; exit code 1 on a regression."""
    update_baseline: bool = False
    """Puts the parts that were run into the baseline."""
    baseline: Path = BASELINE


def main(args: Args) -> None:
    """Measures, prints tables, writes JSON, judges."""
    baseline = _read(args.baseline) if args.gate or args.update_baseline else None
    if args.gate and baseline is None:
        raise ValueError(f"no baseline {str(args.baseline)!r}: see --update-baseline")
    # Every compilation that is timed is a real one.
    jax.config.update("jax_enable_compilation_cache", False)
    result: dict[str, Any] = {
        "parts": {},
        "quick": args.quick,
        "versions": versions() | peer_versions(),
    }
    for name in args.parts:
        load, start = os.getloadavg(), time.perf_counter()
        part = PARTS[name](args.quick, args.data)
        seconds = time.perf_counter() - start
        result["parts"][name] = record(part, load, seconds)
        print(f"\n{name}, {seconds:.0f} s")
        show(part)
        write_result(args.out, result)
    print(f"\nwritten to {args.out}")
    if args.update_baseline:
        write_result(args.baseline, merge(result, baseline))
        print(f"baseline: {args.baseline}")
    if args.gate and baseline:
        finish(result, baseline)


def record(part: Part, load: tuple[float, ...], seconds: float) -> dict[str, Any]:
    """A part as JSON has it, with the machine's load before and after."""
    return {
        "rows": [asdict(row) for row in part.rows],
        "ratios": {name: ratio._asdict() for name, ratio in part.ratios.items()},
        "counts": part.counts,
        "load": [load, os.getloadavg()],
        "seconds": seconds,
    }


def finish(result: dict[str, Any], baseline: dict[str, Any]) -> None:
    """Prints the gate's verdict, and exits with 1 if there is a regression."""
    verdict = judge(result, baseline)
    machines = [each["versions"]["machine"] for each in (result, baseline)]
    if machines[0] != machines[1]:
        print(f"gate: this is {machines[0]}, the baseline's was {machines[1]}")
    for line in verdict.remarks:
        print(f"gate: {line}")
    for line in verdict.regressions:
        print(f"gate: regression: {line}")
    if verdict.regressions:
        raise SystemExit(1)
    print("gate: no regression")


def _read(file: Path) -> dict[str, Any] | None:
    return json.loads(file.read_text(encoding="utf-8")) if file.is_file() else None


if __name__ == "__main__":
    run_script(main, Args)

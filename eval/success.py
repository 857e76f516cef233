"""Success over seeds: `python eval/success.py --seeds 100000:100100 --out success.json`.

A killed run goes on after the batches that it has finished (`runs/pieces`).
"""

from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from jaxplan import tasks
from jaxplan.cli import run_script
from jaxplan.evaluation import ClosedLoopConfig, evaluate, parse_seeds
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.result import write_result
from jaxplan.pretrained import load_pair, shipped
from jaxplan.ranges import Checked


@dataclass(frozen=True)
class Args(Checked):
    """Runs the whole method on each seed and says how often it succeeds."""

    seeds: str = "100000:100100"
    """FIRST:END, END excluded. The shipped weights never saw seeds from 100000 on."""
    out: Path = Path("runs/success.json")
    weights: Path | None = None
    """Directory with predictor, sampler and manifest; None = those shipped for the scene."""
    phases: bool = False
    """Keeps what each phase did: ten times the size."""
    study: ClosedLoopConfig = ClosedLoopConfig()


def main(args: Args) -> None:
    """Evaluates, writes JSON, prints the rate, the reasons of failure and toggle errors."""
    seeds = parse_seeds(args.seeds)
    tasks.check(args.study.task, args.study.variant)
    weights = load_pair(args.weights or shipped(args.study.variant))
    with tqdm(total=len(seeds), unit="episode") as bar:
        result = evaluate(seeds, weights, args.study, bar.update, Memo())
    if not args.phases:
        for episode in result["episodes"]:
            del episode["phases"]
    write_result(args.out, result)
    low, high = result["wilson_95"]
    print(
        f"success {result['successes']}/{result['trials']} = {result['success_rate']:.3f} "
        f"(95 %: {low:.3f} to {high:.3f})"
    )
    for episode in result["episodes"]:
        if not episode["success"]:
            print(f"  seed {episode['seed']}: {episode['failure']}")
    if error := result["toggle_error"]:
        for toggle, row in error["per_toggle"].items():
            print(
                f"  toggle error, {toggle}: mean {row['mean']:.4f}, "
                f"median {row['median']:.4f} rad over {row['phases']} phases"
            )
        print(
            f"  toggle error, all: mean {error['mean']:.4f}; "
            f"to the nearest toggle (paper): {error['nearest_toggle_mean']:.4f} rad"
        )
    print(f"{result['seconds']:.0f} s; written to {args.out}")


if __name__ == "__main__":
    run_script(main, Args)

"""Table 4: time to the first solution of an episode, phase by phase, one episode at a time.

    python eval/ttfs.py
    python eval/ttfs.py --variant cluttered --quick

On recorded problems, so that all samplers plan the same phases: the upper network, the
sampler's banks and the search, rendering and execution left out, programs warm. Samplers
take turns at each phase, with banks of the same size. The column "one at a time" is the
letter of the paper: each learned proposal that the search used costs a call of its own.
"""

import dataclasses
import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from parts.episode_timing import PROPOSALS, UNIFORM, Bench, episode, name_of, prices
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.config import PAPER_PLANNER
from jaxplan.evaluation.memo import code_digest
from jaxplan.evaluation.recorded_study import RecordedStudy, StudyArgs
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.statistics import ratio_of_means
from jaxplan.evaluation.tables import Estimate, Table
from jaxplan.provenance import versions
from jaxplan.ranges import Count
from jaxplan.samplers.bank import SIZE

BASE, CVAE, FEW = "ours (diffusion, DDIM-25)", "CVAE", "few-step"
SAMPLERS: dict[str, tuple[str, dict[str, Any], tuple[float, float] | None]] = {
    BASE: ("sampler", {"num_inference_steps": 25}, (1.0, 1.0)),
    "ours (diffusion, DDIM-10)": ("sampler", {"num_inference_steps": 10}, (0.45, 0.49)),
    FEW: ("few_step", {}, None),
    CVAE: ("cvae", {}, (0.16, 0.24)),
    "conditional GAN": ("gan", {}, (0.20, 0.27)),
}
"""Weights, changes to their config, and the paper's figures at p_uniform 0.2 and 0.6."""
PIECE = 5
"""Episodes of a piece that is kept as soon as it is done."""


@dataclass(frozen=True)
class Args(StudyArgs):
    """Times planning of recorded episodes."""

    seeds: str = "300000:300100"
    p_uniform: tuple[float, ...] = (0.2, 0.6)
    method: str = "rrt_connect"
    """Or `rrt`, in which every phase asks the sampler."""
    bank: Count = SIZE
    """Segments that a sampler draws at a time."""


def main(args: Args) -> None:
    """Times, prints the tables, writes JSON."""
    start = time.perf_counter()
    study = RecordedStudy(args)
    bench: Bench | None = None
    trials = np.unique(study.problems.seed)[: 8 if args.quick else None]
    common = study.settings() | {
        "planner": dataclasses.asdict(PAPER_PLANNER) | {"method": args.method},
        "p_uniform": args.p_uniform,
        "bank": args.bank,
        "machine": versions()["machine"],
        "code": code_digest(),
    }

    def warm() -> Bench:
        nonlocal bench
        sides = {name: (weights, made) for name, (weights, made, _) in SAMPLERS.items()}
        bench = bench or Bench(study, sides, args.p_uniform, args.method, args.bank)
        return bench

    timed: list[dict[str, Any]] = []
    for first in tqdm(range(0, len(trials), PIECE), unit="piece"):
        seeds = trials[first : first + PIECE].tolist()
        timed += study.memo(
            common | {"script": "ttfs", "timed": seeds},
            lambda seeds=seeds: [episode(warm(), seed) for seed in seeds],
        )
    paid = study.memo(
        common | {"script": "ttfs", "prices": PROPOSALS}, lambda: prices(warm())
    )
    sides = list(timed[0]["sides"])
    tables = [
        _table(args, index, p, timed, paid) for index, p in enumerate(args.p_uniform)
    ]
    tables.append(_whole(timed, sides[0]))
    result = Result(
        tables,
        common | {"timed_trials": len(trials), **paid},
        _shortfalls(tables, timed, sides[0]),
        args.quick,
        time.perf_counter() - start,
    )
    result.show()
    name = "ttfs" if args.method == "rrt_connect" else f"ttfs_{args.method}"
    result.write(args.path(name))
    print(f"written to {args.path(name)}")


class Times(NamedTuple):
    """One side over N episodes."""

    seconds: np.ndarray
    """Upper network, banks and search [s]."""
    literal: np.ndarray
    """The same with a call for each proposal that was used [s]."""
    learned: np.ndarray
    """Proposals used."""
    solved: np.ndarray
    """All phases."""


def _times(
    timed: list[dict[str, Any]], prices: dict[str, Any], sampler: str, p: float
) -> Times | None:
    name = name_of(sampler, p)
    if name not in timed[0]["sides"]:
        return None
    rows = np.array([episode["sides"][name] for episode in timed])
    upper = np.array([episode["upper"] for episode in timed])
    phases = np.array([episode["phases"] for episode in timed])
    search, banks, _, learned, solved = rows.T
    price = prices["seconds_per_proposal"].get(sampler, 0.0)
    literal = upper + search - banks + price * learned
    return Times(upper + search, literal, learned, solved == phases)


def _table(
    args: Args, index: int, p: float, timed: list[dict[str, Any]], prices: dict
) -> Table:
    base = _times(timed, prices, BASE, p)
    rows = []
    for name, (_, _, paper) in (*SAMPLERS.items(), (UNIFORM, ("", {}, None))):
        times = _times(timed, prices, name, 1.0 if name == UNIFORM else p)
        figure = paper[index] if paper and index < len(paper) else None
        if times is None or base is None:
            rows.append([name, "no weights", *[None] * 5, figure])
            continue
        rows.append(
            [
                name,
                _median(times.seconds[times.solved]),
                _ratio(times.seconds, base.seconds, times.solved, base.solved),
                float(times.learned[times.solved].mean()),
                float(np.mean(times.literal[times.solved])),
                _ratio(times.literal, base.literal, times.solved, base.solved),
                int(times.solved.sum()),
                figure,
            ]
        )
    return Table(
        f"time to first solution of an episode, {args.method}, p_uniform = {p}",
        [
            "sampler",
            "median [s]",
            "normalised",
            "learned proposals used",
            "one at a time: mean [s]",
            "one at a time: normalised",
            "episodes solved",
            "paper",
        ],
        rows,
        f"Banks of {args.bank} segments, drawn when a search asks. The row without a "
        "sampler has p_uniform = 1.",
    )


def _whole(timed: list[dict[str, Any]], name: str) -> Table:
    """Planning of whole episodes by our sampler, smoothing and timing of motions included."""
    upper = np.array([episode["upper"] for episode in timed])
    search, banks, smoothing, _, _ = np.array([e["sides"][name] for e in timed]).T
    parts = {
        "upper network": upper,
        "sampler": banks,
        "search": search - banks,
        "all up to the first solution": upper + search,
        "shortcuts, spline, timing, validation": smoothing,
        "all": upper + search + smoothing,
    }
    return Table(
        f"planning of a whole episode, {name}",
        ["part", "median [s]"],
        [[part, _median(seconds)] for part, seconds in parts.items()],
    )


def _median(values: np.ndarray) -> Estimate:
    value = float(np.median(values)) if len(values) else float("nan")
    if len(values) < 2:
        return Estimate(value, float("nan"), float("nan"))
    low, high = np.quantile(values, [0.1, 0.9])
    return Estimate(value, float(low), float(high))


def _ratio(
    times: np.ndarray, base: np.ndarray, solved: np.ndarray, base_solved: np.ndarray
) -> Estimate:
    """Of the means over the episodes that each solves, bootstrapped over episodes."""
    sides = times * solved, solved, base * base_solved, base_solved
    return Estimate(*ratio_of_means(*sides, np.arange(len(times))))


def _shortfalls(
    tables: list[Table], timed: list[dict[str, Any]], name: str
) -> list[str]:
    """DDIM-25 at most 1.5 and few-step at most 1.0 of the CVAE; half a second an episode."""
    lines = []
    for table in tables[:-1]:
        ratio = {row[0]: row[2].value for row in table.rows if row[2] is not None}
        for sampler, aim in ((BASE, 1.5), (FEW, 1.0)):
            if CVAE in ratio and sampler in ratio:
                against = ratio[sampler] / ratio[CVAE]
                if not against <= aim:
                    lines.append(
                        f"{table.title}: {sampler} takes {against:.2f} of the CVAE's "
                        f"time (aim {aim})"
                    )
    seconds = [e["upper"] + e["sides"][name][0] for e in timed]
    if not np.median(seconds) < 0.5:
        lines.append(f"planning of an episode: {np.median(seconds):.2f} s (aim 0.5)")
    return lines


if __name__ == "__main__":
    run_script(main, Args)

"""Table 2: tree expansions of all samplers on the same recorded problems.

    python eval/expansions.py
    python eval/expansions.py --variant cluttered --quick

One proposal at a time (`workers=1`), so that counts are those of the sequential
algorithms. Trials are the recorded episodes that ended well; a search that fails counts
with its whole budget. Phases whose straight motion is not free are shown apart: the others
tell nothing about a sampler. So are those that lead past an obstacle by one of several ways, by
whether the episode closes one.
"""

import math
import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from parts.named import named
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.config import PAPER_PLANNER
from jaxplan.data import TOGGLES
from jaxplan.evaluation.expansions import Counts, normalised, solved_share
from jaxplan.evaluation.methods import BACKBONES, METHODS, OURS, Backbone, planner
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.evaluation.recorded_study import RecordedStudy, StudyArgs
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.tables import Table
from jaxplan.ranges import Count


@dataclass(frozen=True)
class Args(StudyArgs):
    """Counts expansions on recorded problems."""

    backbones: tuple[str, ...] = tuple(backbone.name for backbone in BACKBONES)
    """In which the rows are compared."""
    methods: tuple[str, ...] = tuple(method.name for method in METHODS)
    """Those rows."""
    max_expansions: Count = PAPER_PLANNER.max_expansions
    """N_rrt. The paper takes what is large enough that success has saturated."""


class Group(NamedTuple):
    """Some of the phases."""

    name: str
    rows: np.ndarray


def main(args: Args) -> None:
    """Searches, prints tables, writes JSON."""
    start = time.perf_counter()
    chosen = named("backbones", {each.name: each for each in BACKBONES}, args.backbones)
    methods = named("methods", {each.name: each for each in METHODS}, args.methods)
    study = RecordedStudy(args)
    problems = study.problems
    tables: list[Table] = []
    shortfalls: list[str] = []
    bar = tqdm(total=len(chosen) * len(methods), unit="search")
    for backbone in chosen:
        counts: dict[str, Counts] = {}
        rows = np.flatnonzero(problems.episode < (backbone.trials or math.inf))
        some = problems.take(rows)
        for method in methods:
            weights = method.weights and study.weights(method.weights)
            if method.weights is None or weights:
                config = planner(backbone, method, max_expansions=args.max_expansions)
                answers = study.answers(config, weights or None, rows)
                counts[method.name] = Counts(
                    answers.expansions, answers.solved, some.episode
                )
            bar.update()
        groups = [
            Group("all phases", np.ones(len(rows), bool)),
            Group("blocked phases", some.blocked),
            *past_the_obstacle(some, len(study.task.zones)),
        ]
        for group in groups:
            tables.append(compare(backbone, group, counts))
        tables.append(per_toggle(backbone, some, counts))
        shortfalls += judge(backbone, args.variant, groups[1], counts)
    bar.close()
    seconds = time.perf_counter() - start
    settings = study.settings() | {"max_expansions": args.max_expansions}
    result = Result(tables, settings, shortfalls, args.quick, seconds)
    result.show()
    result.write(args.path("expansions"))
    print(f"written to {args.path('expansions')}")


def past_the_obstacle(problems: RecordedProblems, ways: int) -> list[Group]:
    """Phases that can be passed by several ways, with all of them open and with one closed."""
    if ways < 2:
        return []
    past, closed = problems.past_the_obstacle, problems.closed
    return [
        Group("past the obstacle, all ways open", past & ~closed),
        Group("past the obstacle, a way closed", past & closed),
    ]


def compare(backbone: Backbone, group: Group, counts: dict[str, Counts]) -> Table:
    """All methods on some of the phases."""
    own = counts.get(OURS)
    rows = []
    half = {n for n, c in counts.items() if c.solved[group.rows].mean() >= 0.5}
    common = group.rows & np.all([counts[n].solved for n in half], axis=0)
    for method in METHODS:
        if method.name not in counts or own is None:
            rows.append([method.name, "not measured", *[None] * 5, method.paper])
            continue
        count = counts[method.name]
        rows.append(
            [
                method.name,
                solved_share(count, group.rows),
                float(count.expansions[group.rows].mean()),
                normalised(count, own, group.rows),
                normalised(count, own, common) if method.name in half else None,
                normalised(
                    count, own, group.rows & count.solved, group.rows & own.solved
                ),
                normalised(count, own, group.rows, whole_trials=True),
                method.paper,
            ]
        )
    return Table(
        f"{backbone.name}, {group.name} ({int(group.rows.sum())})",
        [
            "method",
            "solved %",
            "expansions",
            "normalised, failures at N_rrt",
            "on what all solve",
            "successes only",
            "whole trials that succeed",
            "paper",
        ],
        rows,
        f"{backbone.note} All solve {int(common.sum())} of these phases (rows that "
        "solve less than half left out).",
    )


def per_toggle(
    backbone: Backbone, problems: RecordedProblems, counts: dict[str, Counts]
) -> Table:
    """Mean expansions by the toggle that comes next; blocked phases, failures at N_rrt."""
    every = np.ones(len(problems.toggle), bool)
    groups = [
        Group(f"{name}{suffix}", some & (problems.toggle == index))
        for suffix, some in (("", every), (" blocked", problems.blocked))
        for index, name in enumerate(TOGGLES)
    ]
    rows = []
    for name, count in counts.items():
        means = [
            float(count.expansions[g.rows].mean()) if g.rows.any() else None
            for g in groups
        ]
        rows.append([name, *means])
    return Table(
        f"{backbone.name}, expansions of a phase by the toggle it leads to",
        ["method", *(f"{g.name} ({int(g.rows.sum())})" for g in groups)],
        rows,
    )


def judge(
    backbone: Backbone, variant: str, group: Group, counts: dict[str, Counts]
) -> list[str]:
    """Where a method needs fewer expansions, in relation to ours, than in the paper, or than 1."""
    if OURS not in counts or not group.rows.any():
        return []
    lines = []
    for method in METHODS:
        if method.name not in counts:
            continue
        ratio = normalised(counts[method.name], counts[OURS], group.rows).value
        aim = method.paper or 1.0
        if not ratio >= aim:
            lines.append(
                f"{backbone.name}, {variant}, blocked phases: {method.name} needs "
                f"{ratio:.2f} of our expansions (aim {aim})"
            )
    return lines


if __name__ == "__main__":
    run_script(main, Args)

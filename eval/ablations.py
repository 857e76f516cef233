"""What each part of the method gives, over the blocked phases of recorded problems.

    python eval/ablations.py
    python eval/ablations.py --variant cluttered --quick

DDIM steps, the uniform share `p_uniform`, the condition's parts, the planner's named
switches, and the budget N_rrt. Phases whose straight motion is free are left out: there
all rows do the same. Counts are sequential, failures count with their whole budget.
"""

import dataclasses
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from jaxplan.cli import run_script
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.expansions import Counts, normalised, solved_share
from jaxplan.evaluation.methods import BACKBONES, METHODS, OURS, Backbone, planner
from jaxplan.evaluation.recorded_study import RecordedStudy, StudyArgs
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.tables import Estimate, Table

STEPS = (25, 10, 4, 1)
P_UNIFORM = (0.0, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
MASKS = {
    "": "whole condition",
    "toggle": "no toggle (the subgoal in its place)",
    "subgoal": "no subgoal (the toggle in its place)",
    "image": "no picture (mean features)",
}
SWITCHES: dict[str, dict[str, Any]] = {
    "as it is": {},
    "no tree context (the letter)": {"tree_context": False},
    "uniform segments independent of q_rand (the letter)": {
        "uniform_mode": "independent"
    },
    "ties toward the toggle, 0.05 rad": {"toggle_tie_break": 0.05},
    "goal's tree uniform only": {"goal_tree": "uniform"},
    "4 workers": {"workers": 4},
    "16 workers": {"workers": 16},
}
BUDGETS = (50, 100, 200, 500, 1000, 2000)
OURS_METHOD = next(method for method in METHODS if method.name == OURS)
RIVAL = next(method for method in METHODS if "5 %" in method.name)


@dataclass(frozen=True)
class Args(StudyArgs):
    """Ablations on recorded problems."""

    backbones: tuple[str, ...] = ("rrt",)
    """Also: rrt_connect."""


def main(args: Args) -> None:
    """Searches, prints tables, writes JSON."""
    start = time.perf_counter()
    study = RecordedStudy(args)
    rows = np.flatnonzero(study.problems.blocked)[: 64 if args.quick else None]
    if study.weights("sampler") is None:
        raise ValueError(f"no sampler in {study.directory}")
    backbones = [each for each in BACKBONES if each.name in args.backbones]
    if len(backbones) < len(args.backbones):
        known = ", ".join(each.name for each in BACKBONES)
        raise ValueError(f"backbones {args.backbones}: there are {known}")
    tables: list[Table] = []
    for backbone in tqdm(backbones, unit="backbone"):
        tables += list(study_backbone(study, backbone, rows))
    settings = study.settings() | {"problems_used": len(rows)}
    seconds = time.perf_counter() - start
    result = Result(tables, settings, [], args.quick, seconds)
    result.show()
    result.write(args.path("ablations"))
    print(f"written to {args.path('ablations')}")


def study_backbone(
    study: RecordedStudy, backbone: Backbone, rows: np.ndarray
) -> Iterator[Table]:
    """All ablations in one backbone."""
    sampler = study.weights("sampler")
    shares = P_UNIFORM[::3] if study.args.quick else P_UNIFORM  # each is compiled
    config = planner(backbone, OURS_METHOD)

    def count(config: PlannerConfig = config, **changes: Any) -> Counts:
        answers = study.answers(config, sampler, rows, **changes)
        trial = study.problems.episode[rows]
        return Counts(answers.expansions, answers.solved, trial)

    base = count()

    def rated(title: str, found: dict[str, Counts], note: str = "") -> Table:
        every = np.ones(len(rows), bool)
        return Table(
            f"{backbone.name}: {title}",
            ["", "solved %", "expansions", "normalised to the method"],
            [
                [
                    name,
                    solved_share(counts, every),
                    float(counts.expansions.mean()),
                    normalised(counts, base, every),
                ]
                for name, counts in found.items()
            ],
            note,
        )

    yield rated(
        "DDIM steps",
        {f"T = {n}": count(num_inference_steps=n) for n in STEPS},
        "In the paper T = 10 gives 'only modest degradation'.",
    )
    yield rated(
        "p_uniform",
        {str(p): count(dataclasses.replace(config, p_uniform=p)) for p in shares},
        "1 = no learned proposals; without any uniform ones (0) the search is incomplete.",
    )
    yield rated(
        "condition",
        {name: count(mask=mask) for mask, name in MASKS.items()},
        "Masked when drawing, the network is not trained anew: what it makes of a "
        "condition in which another part stands in the missing one's place.",
    )
    yield rated(
        "switches of the planner",
        {
            name: count(dataclasses.replace(config, **changes))
            for name, changes in SWITCHES.items()
            if backbone.name == "rrt_connect" or "goal_tree" not in changes
        },
        "With several workers expansions do not know of each other: more of them, in "
        "fewer rounds.",
    )
    yield budgets(study, backbone, rows, count)


def budgets(
    study: RecordedStudy,
    backbone: Backbone,
    rows: np.ndarray,
    count: Callable[..., Counts],
) -> Table:
    """Share solved within N_rrt expansions: trees of a search grow alike in any budget."""
    most = BUDGETS[-1]
    ours = count(planner(backbone, OURS_METHOD, max_expansions=most))
    answers = study.answers(planner(backbone, RIVAL, max_expansions=most), None, rows)
    rival = Counts(answers.expansions, answers.solved, ours.trial)
    return Table(
        f"{backbone.name}: N_rrt",
        ["solved within", OURS, RIVAL.name],
        [[str(n), *(_within(counts, n) for counts in (ours, rival))] for n in BUDGETS],
        "Percent of the blocked phases.",
    )


def _within(counts: Counts, budget: int) -> Estimate:
    solved = counts.solved & (counts.expansions <= budget)
    return solved_share(counts._replace(solved=solved), np.ones(len(solved), bool))


if __name__ == "__main__":
    run_script(main, Args)

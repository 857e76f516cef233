"""Table 1: what `eval/imitation.py` found, as tables."""

from collections.abc import Mapping
from typing import Any

from jaxplan.evaluation.tables import Table
from parts.summary import PAPER, rate


def tables(
    title: str, rows: Mapping[str, dict[str, Any]], paired: Mapping[str, dict[str, Any]]
) -> list[Table]:
    """Success, failures by kind, and the paired tests.

    Args:
        title: What ran.
        rows: By agent, as `evaluation.imitation.summary` has them.
        paired: By the names of two agents, McNemar's test.
    """
    success, failures = [], []
    kinds = list(
        dict.fromkeys(kind for row in rows.values() for kind in row["failures"])
    )
    for name, row in rows.items():
        hit = 100 * row["collisions"]["episodes"] / row["trials"]
        ms = 1e3 * row["seconds_per_decision"]
        success.append([name, rate(row), PAPER.get(name), hit, row["clipped"], ms])
        failures.append([name, *(row["failures"].get(kind, 0) for kind in kinds)])
    tests = [
        [pair, test["only_first"], test["only_second"], f"{test['p']:.2g}"]
        for pair, test in paired.items()
    ]
    trials = next(iter(rows.values()))["trials"]
    return [
        Table(
            f"{title}: success over {trials} episodes",
            [
                "",
                "success, %",
                "paper",
                "episodes with a collision, %",
                "actions clipped",
                "ms a decision",
            ],
            success,
            "A collision: the arm presses on the table, the box or what else stands there by more "
            "than 1 N. Ours decides once a phase and plans around them; policies decide every 8 "
            "actions and have no planner.",
        ),
        Table(f"{title}: failures by kind", ["", *kinds], failures),
        Table(
            f"{title}: McNemar's exact test over the common seeds",
            ["first / second", "only the first", "only the second", "p"],
            tests,
        ),
    ]

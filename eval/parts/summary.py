"""What RESULTS.md says of each section: a few rows out of the tables of its files."""

import re
from collections.abc import Iterator
from typing import Any

from jaxplan.evaluation.tables import Cell, Estimate, Table

PAPER = {
    "ours": 95.67,
    "diffusion_policy": 89.33,
    "lstm_gmm": 69.67,
    "transformer": 60.33,
}
"""Success of Table 1 [%]."""
PAPER_SUCCESS, PAPER_NOMINAL, PAPER_ERROR = PAPER["ours"], 96.0, 0.0112
"""Success of Table 1 and of Table 5 [%], toggle error of Table 5 [rad]."""

OF_SETTING = ", episodes", ", success %", ", nearest toggle [rad]"
"""Columns of Table 5 for each of the weights."""

Found = dict[str, dict[str, Any]]
"""By the name of the file: what it says."""


def rate(result: dict[str, Any]) -> Estimate:
    """Success [%]."""
    return Estimate(
        100 * result["success_rate"], *(100 * x for x in result["wilson_95"])
    )


def scene(result: dict[str, Any]) -> str:
    """Of `eval/success.py`: the task's variant, and whether failed grasps are repeated."""
    study = result["config"]
    return ", ".join([study["variant"], *["recovery"] * study["algorithm"]["regrasp"]])


def success(found: Found) -> Table:
    """As `recovery`, beside the paper's."""
    ours = recovery(found)
    paper = ["paper", None, PAPER_SUCCESS, PAPER_ERROR]
    return Table(ours.title, ours.columns, [*ours.rows, paper])


def robustness(found: Found) -> Table:
    """A row a setting: success and error to the nearest toggle, of each of the weights."""
    weights: list[str] = []
    rows: dict[str, dict[str, list[Cell]]] = {}
    for name, result in found.items():
        of = (
            name.removeprefix("robustness_")
            .removesuffix("_beyond")
            .removesuffix("_mugs")
            .replace("_", " ")
        )
        weights += [] if of in weights else [of]
        for setting, one in result["settings"].items():
            cells = [one["trials"], rate(one), one["toggle_error_nearest"]]
            rows.setdefault(setting, {})[of] = cells
    columns = [f"{of}{what}" for of in weights for what in OF_SETTING]
    body = [
        [setting, *(cell for of in weights for cell in by.get(of, [None] * 3))]
        for setting, by in rows.items()
    ]
    return Table("", ["", *columns], body)


def imitation(found: Found) -> Table:
    """Success of each agent, a column a file, beside the paper's."""
    found = {name: result for name, result in found.items() if "policies" in result}
    names = list(dict.fromkeys(name for r in found.values() for name in r["policies"]))
    columns = [name.removeprefix("imitation_") for name in found]
    rows: list[list[Any]] = []
    for name in names:
        of = [result["policies"].get(name) for result in found.values()]
        rows.append([name, *(row and rate(row) for row in of), PAPER.get(name)])
    return Table("", ["success, %", *columns, "paper"], rows)


def recovery(found: Found) -> Table:
    """A row a file: how many episodes succeed, and how well toggles are predicted."""
    rows: list[list[Any]] = []
    for result in found.values():
        error = (result.get("toggle_error") or {}).get("nearest_toggle_mean")
        rows.append([scene(result), result["trials"], rate(result), error])
    columns = ["scene", "episodes", "success, %", "toggle error to the nearest [rad]"]
    return Table("", columns, rows)


def expansions(found: Found) -> Table:
    """Expansions over those of ours, in the phases that a straight motion does not solve."""
    return _side_by_side(
        found,
        r"(?P<column>rrt\w*), blocked phases",
        "normalised, failures at N_rrt",
        "Blocked phases; failures count as the whole budget.",
    )


def ways(found: Found) -> Table:
    """How proposals lie about the ways of a problem, all of them open."""
    first = found["proposed_ways"]["tables"][0]
    return Table("", ["", *first["columns"][1:]], first["rows"])


def proposals(found: Found) -> Table:
    """Time of a proposal over that of DDIM-25."""
    return _side_by_side(
        found, r"Time of a proposal, (?P<column>.*)", "DDIM 25 = 1", ""
    )


def first_solutions(found: Found) -> Table:
    """Time to the first solution of an episode over that of ours."""
    return _side_by_side(
        found,
        r"time to first solution of an episode, (?P<column>.*)",
        "normalised",
        "",
    )


def scene_sampler(found: Found) -> Table:
    """With `few_step`, and with none: all sets, and the hardest."""
    rows = found["scene_sampler"]["rows"]
    columns = [
        "problems",
        "solved",
        "expansions",
        "none",
        "checks to none",
        "to none [ms]",
    ]
    body: list[list[Any]] = []
    for name in ("all", "cage"):
        ours, none = rows[name]["few_step"], rows[name]["none"]
        solved = f"{ours['solved']} of {ours['of']}"
        counts = [ours["expansions"], none["expansions"], ours["checks_ratio"]]
        body.append([name, solved, *counts, ours["ms_ratio"]])
    return Table("", columns, body)


def speed(found: Found) -> Table:
    """MotionBenchMaker: ours beside the better of OMPL's ranges."""
    robots = {"motion_bench": "Panda", "motion_bench_fetch": "Fetch"}
    rows: list[list[Any]] = []
    for name in robots.keys() & found.keys():
        by_set: dict[str, list[dict[str, Any]]] = {}
        for row in found[name]["rows"]:
            if row["median"] is not None:
                by_set.setdefault(row["scene"], []).append(row)
        for scene, (ours, *peers) in by_set.items():
            solved = f"{ours['more']['solved']} of {ours['more']['of']}"
            said = [f"{robots[name]}, {scene}", solved, ours["median"]]
            if peers:
                best = min(peers, key=lambda row: row["median"])
                tails = [row["more"]["p95"] for row in (best, ours)]
                times = best["median"] / ours["median"], tails[0] / tails[1]
                said += [best["median"], *times]
            rows.append(said + [None] * (6 - len(said)))
    columns = [
        "problems",
        "solved",
        "ours [ms]",
        "OMPL [ms]",
        "times as fast",
        "at p95",
    ]
    note = "Medians; the last two columns are OMPL's time over ours."
    for name in sorted(robots.keys() & found.keys()):
        if give_up := found[name].get("give_up"):
            note += f" On the {robots[name]} OMPL gave up after {give_up:g} s."
    return Table("", columns, sorted(rows, key=lambda row: row[0]), note)


def _side_by_side(found: Found, title: str, column: str, note: str) -> Table:
    """One column of several tables, a row for each name in their first columns."""
    columns: list[str] = []
    rows: dict[str, dict[str, Cell]] = {}
    for head, table in _matching(found, title):
        columns.append(head)
        index, paper = table["columns"].index(column), table["columns"].index("paper")
        for row in table["rows"]:
            cells = rows.setdefault(row[0], {"paper": row[paper]})
            cells[head] = row[index]
    columns.append("paper")
    body = [
        [name, *(cells.get(head) for head in columns)] for name, cells in rows.items()
    ]
    return Table("", ["", *columns], body, note)


def _matching(found: Found, title: str) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, result in found.items():
        scene = name.rpartition("_")[2]
        for table in result["tables"]:
            if match := re.match(title, table["title"]):
                several = len(found) > 1
                yield (
                    f"{scene}, {match['column']}" if several else match["column"],
                    table,
                )

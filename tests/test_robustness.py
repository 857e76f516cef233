"""Table 5's script: what it makes of results, and of names that it does not know."""

import subprocess
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "eval"))

from parts.summary import robustness
from robustness import AIMS, PAPER, SETTINGS, shortfalls, summary, table

from jaxplan.evaluation.tables import markdown

ROOT = Path(__file__).parents[1]


def result(kinds: list[str | None]) -> dict:
    """Of a closed loop, an episode a kind of failure; None succeeded."""
    successes = sum(kind is None for kind in kinds)
    return {
        "success_rate": successes / len(kinds),
        "wilson_95": [0.1, 0.9],
        "successes": successes,
        "trials": len(kinds),
        "toggle_error": {"mean": 0.03, "median": 0.01, "nearest_toggle_mean": 0.02},
        "episodes": [{"success": kind is None, "kind": kind} for kind in kinds],
        "seconds": 1.0,
    }


def test_failures_are_counted_by_kind():
    found = summary(result([None, "dropped", "missed rim", "dropped", None]))
    assert found["failures"] == {"dropped": 2, "missed rim": 1}
    assert (found["successes"], found["trials"]) == (2, 5)
    assert found["toggle_error_nearest"] == 0.02
    text = markdown(table({"mild": found, "colours": found}))
    assert "dropped 2, missed rim 1" in text
    assert f"| {PAPER['mild']} " in text


def test_what_falls_short_is_named():
    found = summary(result([None] * 24 + ["dropped"]))
    assert shortfalls({"mild": found}, "plain") == [
        "plain, mild: success 96.0 % (aim 97)"
    ]
    assert shortfalls({"nominal": found}, "cluttered") == [
        "cluttered, nominal: success 96.0 % (aim 98)",
        "cluttered, nominal: 0.0200 rad to the nearest toggle (aim 0.0112)",
    ]
    assert shortfalls({"strong": found}, "plain") == []


def test_files_stand_side_by_side_in_the_summary():
    found = summary(result([None, "dropped"]))
    files = {
        "robustness_plain": {"settings": {"nominal": found, "mild": found}},
        "robustness_plain_beyond": {"settings": {"light": found}},
        "robustness_without_variation": {"settings": {"mild": found}},
    }
    shown = robustness(files)
    assert shown.columns[2::3] == ["plain, success %", "without variation, success %"]
    assert [row[0] for row in shown.rows] == ["nominal", "mild", "light"]
    assert shown.rows[0][4:] == [None] * 3
    assert shown.rows[1][5].value == 50
    assert shown.rows[2][1] == 2


def test_the_paper_s_settings_are_there():
    assert {*PAPER} <= {*SETTINGS}
    assert all({*aims} <= {*SETTINGS} for aims in AIMS.values())
    plain = [name for name in SETTINGS if SETTINGS[name].perturbation.nothing]
    mugs = "mugs", "mugs held out"
    assert plain == ["nominal", *mugs, *(f"{name}, recovery" for name in mugs)]
    drawn = ["train", "held_out"]
    assert [SETTINGS[name].objects for name in plain] == ["one", *drawn, *drawn]
    assert [SETTINGS[name].regrasp for name in plain] == [False] * 3 + [True] * 2
    assert SETTINGS["mild, each query"].perturbation.each_query


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--settings", "wild"], "no setting 'wild': there are nominal, mild"),
        (["--variant", "shelf"], "variant 'shelf' of mug: plain or cluttered or ways"),
        (["--weights", "nowhere"], "missing weights: no nowhere/manifest.json"),
    ],
)
def test_bad_input_is_one_line(arguments, line):
    done = subprocess.run(
        [sys.executable, "eval/robustness.py", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {line}")
    assert done.stderr.count("\n") == 1

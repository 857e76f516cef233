"""The studies on recorded problems: statistics, stores, methods, tables; RESULTS.md is true."""

import dataclasses
import json
import math
import re
import subprocess
import sys
import time
from pathlib import Path

import jax
import numpy as np
import pytest

from jaxplan.base import Observation, Subgoal
from jaxplan.config import PAPER_PLANNER
from jaxplan.data import DataError
from jaxplan.evaluation import problems as store
from jaxplan.evaluation.expansions import Counts, normalised, solved_share
from jaxplan.evaluation.memo import Memo
from jaxplan.evaluation.methods import BACKBONES, METHODS, planner
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.evaluation.statistics import bootstrap
from jaxplan.evaluation.tables import Estimate, Table, cell, markdown
from jaxplan.learned import LearnedProposals, Upper
from jaxplan.networks import Cond
from jaxplan.pretrained import load_pair
from jaxplan.samplers import Bank

sys.path.append(str(Path(__file__).parents[1] / "eval"))
EVERY = np.ones(4, bool)


def counts(expansions, solved=EVERY, trial=(0, 0, 1, 1)) -> Counts:
    return Counts(np.array(expansions), np.array(solved), np.array(trial))


def some_problems(seeds=(7, 7, 9)) -> RecordedProblems:
    """Arrays of the right kinds; their numbers mean nothing."""
    rng, count = np.random.default_rng(0), len(seeds)
    flags = {"success", "last", "blocked", "held", "ignored"}
    shapes = {
        "image": (88, 136, 3),
        "object_pose": (1, 7),
        "slot_pose": (0, 7),
        "slot_size": (0, 3),
        "geom_pos": (0, 3),
        "geom_size": (0, 3),
        "passive": (2,),
        "held": (1,),
        "ignored": (5,),
    }
    columns = {}
    for name in RecordedProblems._fields:
        joints = name.startswith("q") or name == "target"
        shape = (count, *shapes.get(name, (7,) if joints else ()))
        columns[name] = rng.random(shape, np.float32)
        if name in flags:
            columns[name] = columns[name] > 0.5
    numbers = {"seed": np.array(seeds, np.int32), "phase": np.arange(count)}
    return RecordedProblems(**(columns | numbers))


def test_a_method_against_itself_is_one():
    own = counts([10, 20, 30, 40])
    assert normalised(own, own, EVERY) == Estimate(1.0, 1.0, 1.0)


def test_normalised_is_the_ratio_of_means():
    ratio = normalised(counts([20, 40, 60, 80]), counts([10, 20, 30, 40]), EVERY)
    assert ratio.value == pytest.approx(2)
    assert ratio.low == pytest.approx(2) == ratio.high
    rows = np.array([True, False, False, True])
    other = normalised(counts([5, 0, 0, 25]), counts([10, 0, 0, 10]), rows)
    assert other.value == pytest.approx(1.5)


def test_whole_trials_count_only_where_all_phases_are_solved():
    """Trial 1 fails for the method and not for ours: each mean is over its own successes."""
    method = counts([10, 10, 500, 30], [True, True, False, True])
    ratio = normalised(method, counts([5, 5, 10, 10]), EVERY, whole_trials=True)
    assert ratio.value == pytest.approx(20 / 15)


def test_success_is_in_percent():
    solved = solved_share(counts([1] * 4, [True, True, True, False]), EVERY)
    assert solved.value == 75
    assert solved.low < 75 < solved.high
    assert math.isnan(solved_share(counts([1] * 4), ~EVERY).value)


def test_the_bootstrap_covers_a_known_mean():
    """Of 200 samples about 95 % have the true mean inside their interval."""
    rng, inside = np.random.default_rng(1), 0
    for _ in range(200):
        x = rng.normal(3, 1, 40)
        low, high = bootstrap(
            lambda w, x=x: (w @ x) / w.sum(1), np.arange(40), resamples=400
        )
        inside += low <= 3 <= high
    assert 180 <= inside <= 199


def test_groups_are_drawn_whole():
    """Copies of an observation in its group tell nothing new."""
    x = np.random.default_rng(2).normal(size=30)

    def mean(x):
        return lambda weights: (weights @ x) / weights.sum(1)

    once = bootstrap(mean(x), np.arange(30))
    thrice = bootstrap(mean(np.repeat(x, 3)), np.repeat(np.arange(30), 3))
    assert thrice == pytest.approx(once)


def test_a_piece_is_made_once(tmp_path):
    made = []

    def make():
        made.append(1)
        return [len(made)]

    assert Memo(tmp_path)({"a": 1}, make) == [1]
    assert Memo(tmp_path)({"a": 1}, make) == [1]
    assert Memo(tmp_path)({"a": 2}, make) == [2]
    for file in tmp_path.iterdir():
        file.write_bytes(file.read_bytes()[:-9])
    assert Memo(tmp_path)({"a": 1}, make) == [3]


def test_problems_come_back_as_they_were(tmp_path):
    assert store.begin(tmp_path, {"a": 1}) == {}
    first, second = some_problems(), some_problems((11,))
    store.add(tmp_path, "p0.npz", first)
    store.add(tmp_path, "p1.npz", second)
    assert set(store.begin(tmp_path, {"a": 1})) == {"p0.npz", "p1.npz"}
    found = store.read(tmp_path, ["p0.npz", "p1.npz"])
    for name, column in found._asdict().items():
        expected = [getattr(first, name), getattr(second, name)]
        np.testing.assert_array_equal(column, np.concatenate(expected), name)
    assert found.episode.tolist() == [0, 0, 1, 2]
    with pytest.raises(DataError, match="recorded with"):
        store.begin(tmp_path, {"a": 2})


def test_a_damaged_shard_is_named_and_made_again(tmp_path):
    store.begin(tmp_path, {})
    store.add(tmp_path, "p0.npz", some_problems())
    raw = bytearray((tmp_path / "p0.npz").read_bytes())
    raw[len(raw) // 2] ^= 1
    (tmp_path / "p0.npz").write_bytes(raw)
    with pytest.raises(DataError, match=r"p0\.npz"):
        store.read(tmp_path, ["p0.npz"])
    assert store.begin(tmp_path, {}) == {}


@pytest.mark.slow
def test_a_killed_study_says_what_an_unbroken_one_says(tmp_path):
    """`kill -9` in the middle of Table 2 loses nothing and repeats nothing."""
    script = Path(__file__).parents[1] / "eval" / "expansions.py"
    seeds = "300000:300008"

    def start(name: str) -> subprocess.Popen:
        (tmp_path / name).mkdir(exist_ok=True)
        command = [sys.executable, script, "--quick", "--seeds", seeds]
        return subprocess.Popen(command, cwd=tmp_path / name)

    def pieces() -> dict[str, int]:
        found = (tmp_path / "killed" / "runs" / "pieces").glob("*.json")
        return {path.name: path.stat().st_mtime_ns for path in found}

    process, deadline = start("killed"), time.monotonic() + 600
    while len(pieces()) < 5 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.kill()
    process.wait()
    before = pieces()
    assert 5 <= len(before) < 15, "killed at no good time"
    assert start("killed").wait(600) == 0
    assert before.items() <= pieces().items()
    assert start("unbroken").wait(600) == 0
    killed, unbroken = (
        json.loads((tmp_path / name / "runs" / "expansions_plain.json").read_text())
        for name in ("killed", "unbroken")
    )
    assert killed["tables"] == unbroken["tables"]


def test_keys_are_those_of_the_outer_loop():
    """A recorded problem is searched with the random numbers of its episode."""
    problems = some_problems((7, 9))._replace(phase=np.array([4, 4]))
    expected = [jax.random.fold_in(jax.random.key(seed), 4) for seed in (7, 9)]
    assert jax.numpy.array_equal(problems.keys(), jax.numpy.stack(expected))


def test_banks_are_what_the_agent_draws():
    """For each problem, in any order and company, the segments that an episode would get."""
    from jaxplan.evaluation.searches import KeptBanks

    predictor, sampler = load_pair()
    problems = some_problems((3, 5, 8))
    upper, bank = Upper(predictor, "hand"), Bank(sampler)
    propose = LearnedProposals(bank, upper, "hand")
    targets = Subgoal(problems.q_toggle, problems.gripper_toggle > 0.5, problems.target)
    seen = Observation({"hand": problems.image}, problems.q, problems.gripper)
    # None: targets need not come from the predictor that the sampler looks through.
    expected = propose(seen, None, targets, problems.keys())(np.array([0, 2, 1]))
    cond = Cond(
        image=np.asarray(upper.features(seen)),
        q=problems.q,
        gripper=problems.gripper,
        q_toggle=problems.q_toggle,
        gripper_toggle=targets.gripper_toggle,
        q_goal=problems.target,
    )
    banks = KeptBanks(bank, cond, problems.keys())
    banks.of(np.array([1, 2]))(np.array([0, 0]))
    found = banks.of(np.array([2, 0, 1]))(np.array([1, 0, 2]))
    for ours, theirs in zip(found, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs[np.array([2, 0, 1])])


@pytest.mark.long
def test_networks_say_the_same_to_the_last_bit_whoever_is_beside():
    """Alone, and in batches of other sizes: subgoals, features and segments."""
    predictor, sampler = load_pair()
    problems = some_problems((3, 5, 8, 9, 11))
    upper = Upper(predictor, "hand")
    propose = LearnedProposals(Bank(sampler), upper, "hand")

    def said(rows: np.ndarray) -> list[np.ndarray]:
        some = problems.take(rows)
        seen = Observation({"hand": some.image}, some.q, some.gripper)
        subgoal, features = upper(seen, [])
        draw = propose(seen, features, subgoal, some.keys())
        leaves = subgoal, features, draw(np.zeros(len(rows), np.int32))
        return [np.asarray(leaf) for leaf in jax.tree.leaves(leaves)]

    whole = said(np.arange(5))
    for rows in ([2], [4, 0], [1, 2, 3]):
        for leaf, alone in zip(whole, said(np.array(rows)), strict=True):
            np.testing.assert_array_equal(leaf[rows], alone)


@pytest.mark.parametrize("backbone", BACKBONES, ids=lambda backbone: backbone.name)
def test_rows_differ_in_their_proposals_only(backbone):
    """Within a backbone: the same steps, goal tests, budget, and one worker."""
    free = {
        "p_uniform": 0,
        "goal_bias": 0,
        "uniform_mode": "toward",
        "tree_context": False,
        "greedy": False,
    }
    configs = [planner(backbone, method) for method in METHODS]
    assert len({dataclasses.replace(config, **free) for config in configs}) == 1
    assert {config.workers for config in configs} == {1}
    learned = {
        dataclasses.replace(config, tree_context=False)
        for config, method in zip(configs, METHODS, strict=True)
        if method.weights
    }
    assert len(learned) == 1
    assert {c.p_uniform for c in learned} == {PAPER_PLANNER.p_uniform}


def test_cells_are_short_and_nothing_is_a_dash():
    assert cell(None) == cell(float("nan")) == "-"
    assert cell(Estimate(1.234, 1.1, 123.4)) == "1.23 (1.10 to 123)"
    assert cell([2.0, None, None]) == "2.00"
    assert cell(0.01123) == "0.0112"
    lines = markdown(Table("t", ["a", "b"], [["x", 1.0]], "why")).splitlines()
    assert lines[0] == "| a | b    |"
    assert lines[2] == "| x | 1.00 |"
    assert lines[-1] == "why"


def test_results_are_what_the_files_say():
    """The pages are those that `eval/report.py` makes of the committed files."""
    from report import ROOT, report

    pages = report()
    for name, text in pages.items():
        assert (ROOT / name).read_text(encoding="utf-8") == text
    shown = {f"docs/results/{path.name}" for path in (ROOT / "docs/results").iterdir()}
    assert shown == {name for name in pages if name.startswith("docs/results/")}


def test_results_are_short_and_lead_to_all_tables():
    from report import ROOT, report

    pages = report()
    assert pages["RESULTS.md"].count("\n") <= 150
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    titles = []
    for name, text in pages.items():
        titles += re.findall("^#+ (.*)", text, re.MULTILINE)
        assert "****" not in text
        if name != "RESULTS.md":
            assert f"]({name})" in pages["RESULTS.md"]
            assert f": {name.removeprefix('docs/')}\n" in nav
    assert len(titles) == len(set(titles))


def test_the_report_shows_every_figure_and_says_where_ours_is_worse(tmp_path):
    from report import report

    content = {
        "command": "python eval/expansions.py",
        "date": "2026-01-02",
        "settings": {"seeds": "1:2"},
        "shortfalls": ["CVAE needs 0.50 of our expansions"],
        "tables": [
            {"title": "t", "columns": ["m"], "rows": [[[1.5, 1, 2]]], "note": ""}
        ],
    }
    (tmp_path / "expansions_plain.json").write_text(json.dumps(content))
    pages = report(tmp_path, tmp_path)
    page = pages["docs/results/expansions.md"]
    assert "aim: CVAE needs 0.50 of our expansions." in pages["RESULTS.md"]
    assert "1.50 (1 to 2)" in page or "1.50 (1.00 to 2.00)" in page
    assert "`python eval/expansions.py`; 2026-01-02; seeds 1:2" in page
    assert "Not measured: `python eval/proposal_time.py`" in pages["RESULTS.md"]

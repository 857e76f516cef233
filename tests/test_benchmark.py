"""The benchmark's bookkeeping: the gate, ratios, and rows for what is absent. Nothing timed."""

import copy
import json
import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "eval"))

PEER = "MuJoCo C loop, one core"
NAME = f"collision, a scene: jaxplan config_free / {PEER}"
COUNT = "collision, a scene: wrong verdicts of jaxplan config_free"


def result(value: float = 10.0, wrong: int = 0) -> dict:
    """As `benchmark.py` writes it, of one part with one ratio."""
    part = {
        "rows": [{"side": PEER, "median": 1.0, "note": ""}],
        "ratios": {NAME: {"value": value, "least": 0.7, "against": PEER}},
        "counts": {COUNT: wrong},
    }
    versions = {"machine": "a machine"}
    return {"parts": {"collision": part}, "quick": False, "versions": versions}


def without_ratio(**row) -> dict:
    """A run that lacks the ratio, with a row about the peer."""
    found = result()
    found["parts"]["collision"] |= {"ratios": {}, "rows": [row] if row else []}
    return found


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (result(6.9), f"{NAME}: 6.90, baseline 10.00, at least 7.00 expected"),
        (result(float("nan")), f"{NAME}: nan"),
        (result(wrong=1), f"{COUNT}: 1, baseline 0"),
        (without_ratio(), f"{NAME}: missing"),
    ],
    ids=["slower", "not a number", "wrong verdicts", "missing"],
)
def test_a_regression_is_named_and_ends_with_1(found, expected, capsys):
    from benchmark import finish

    with pytest.raises(SystemExit) as ended:
        finish(found, result())
    assert ended.value.code == 1
    assert f"regression: {expected}" in capsys.readouterr().out


@pytest.mark.parametrize("value", [7.1, 10.0, 100.0])
def test_as_fast_or_faster_is_no_regression(value, capsys):
    from benchmark import finish

    finish(result(value), result())
    assert "no regression" in capsys.readouterr().out


@pytest.mark.parametrize("side", [PEER, "all sides"])
def test_what_is_absent_for_a_reason_is_named_and_no_regression(side, capsys):
    from benchmark import finish

    finish(without_ratio(side=side, median=None, note="not installed"), result())
    assert f"{NAME}: not measured (not installed)" in capsys.readouterr().out


def test_a_quick_run_may_leave_ratios_out_but_not_be_slower():
    from parts.gate import judge

    lacking, slower = without_ratio() | {"quick": True}, result(1) | {"quick": True}
    assert judge(lacking, result()).regressions == []
    assert judge(lacking, result()).remarks == [
        f"{NAME}: not measured (left out of a quick run)"
    ]
    assert len(judge(slower, result()).regressions) == 1


def test_parts_that_were_not_run_are_not_judged():
    from parts.gate import judge

    baseline = result()
    baseline["parts"]["planning"] = copy.deepcopy(baseline["parts"]["collision"])
    assert judge(result(), baseline) == ([], [])
    assert judge(baseline, result()) == ([], ["planning: not in the baseline"])


def test_a_baseline_takes_the_parts_that_were_run_and_no_quick_run():
    from parts.gate import merge

    planning = {"parts": {"planning": {}}, "quick": False}
    assert set(merge(planning, result())["parts"]) == {"collision", "planning"}
    assert merge(result(5), result())["parts"] == result(5)["parts"]
    assert merge(result(), None) == result()
    with pytest.raises(ValueError, match="--quick"):
        merge(result() | {"quick": True}, None)


def test_a_run_judges_what_it_wrote(tmp_path, monkeypatch, capsys):
    """Through the door: baseline, the same again, then a slower run."""
    import benchmark
    from parts.rows import Part, compare, row_of

    def part(speed):
        rows = [
            row_of("collision", "a scene", side, "configurations/s", [rate] * 3)
            for side, rate in (("jaxplan config_free", speed), (PEER, 1.0))
        ]
        return Part(rows, compare(rows, "jaxplan config_free", 0.7), {COUNT: 0})

    def run(speed, **flags):
        monkeypatch.setitem(
            benchmark.PARTS, "collision", lambda quick, data: part(speed)
        )
        files = {"out": tmp_path / "run.json", "baseline": tmp_path / "baseline.json"}
        benchmark.main(benchmark.Args(parts=("collision",), **files, **flags))

    with pytest.raises(ValueError, match="no baseline"):
        run(10.0, gate=True)
    run(10.0, update_baseline=True)
    run(10.0, gate=True)
    with pytest.raises(SystemExit):
        run(5.0, gate=True)
    assert "jaxplan config_free" in capsys.readouterr().out
    written = json.loads((tmp_path / "run.json").read_text())
    assert written["parts"]["collision"]["ratios"][NAME]["value"] == 5.0


def test_ratios_say_how_many_times_faster_we_are():
    from parts.rows import Row, compare, row_of

    speeds = [row_of("p", "s", n, "1/s", [v]) for n, v in (("jaxplan", 6), ("peer", 2))]
    times = [row_of("p", "t", n, "ms", [v]) for n, v in (("jaxplan", 2), ("peer", 8))]
    noted = [Row("p", "s", "absent peer", note="not installed")]
    ratios = compare(speeds + times + noted, "jaxplan", 0.7)
    assert {name: ratio.value for name, ratio in ratios.items()} == {
        "p, s: jaxplan / peer": 3.0,
        "p, t: jaxplan / peer": 4.0,
    }


def test_absent_peers_are_rows_that_say_so(monkeypatch):
    import peers
    from parts import planning_speed, queries
    from parts.rows import Part, show

    monkeypatch.setattr(peers, "find_spec", lambda package: None)
    rows = queries.rows_of("planning", "a scene", {})
    assert [row.side for row in rows] == list(queries.RANGES)
    rows += [
        planning_speed.ompl_row({}, "a batch", side, [], processes)
        for side, processes in planning_speed.ompl_sides().items()
    ]
    assert all(row.median is None for row in rows)
    assert all("ompl is not installed" in row.note for row in rows)
    assert peers.peer_versions() == {}
    show(Part(rows, {}, {}))


def test_absent_data_are_a_row_that_says_so(tmp_path):
    from parts import compile_time, planning_speed
    from parts.collision_cases import panda_cases

    for measure in (planning_speed.measure, compile_time.measure):
        part = measure(True, tmp_path)
        assert "panda_spheres.json" in part.rows[0].note
        assert (part.rows[0].median, part.ratios, part.counts) == (None, {}, {})
    with pytest.raises(FileNotFoundError, match="panda_spheres"):
        next(panda_cases(tmp_path, 1))

"""Whether a run of the benchmark has regressed from the committed one.

Ratios are compared, not times: both sides of a ratio met the same machine at the same load.
"""

from typing import Any, NamedTuple


class Verdict(NamedTuple):
    """What the gate says."""

    regressions: list[str]
    remarks: list[str]
    """What could not be compared, and why."""


def judge(result: dict[str, Any], baseline: dict[str, Any]) -> Verdict:
    """Compares the parts that were run.

    A ratio has regressed below its own share of the baseline's value, a count above the
    baseline's. A ratio that is missing is a regression too, unless the run was quick or a
    row of its part says why its side or the whole scene has no figures.

    Args:
        result: As `benchmark.py` writes it.
        baseline: An earlier one.
    """
    verdict = Verdict([], [])
    for name, part in result["parts"].items():
        if name not in baseline["parts"]:
            verdict.remarks.append(f"{name}: not in the baseline")
            continue
        before = baseline["parts"][name]
        _judge_ratios(part, before, result["quick"], verdict)
        for what, count in part["counts"].items():
            if count > (allowed := before["counts"].get(what, 0)):
                verdict.regressions.append(f"{what}: {count}, baseline {allowed}")
    return verdict


def merge(result: dict[str, Any], baseline: dict[str, Any] | None) -> dict[str, Any]:
    """The baseline with the parts of a run in place of its own.

    Raises:
        ValueError: The run was quick.
    """
    if result["quick"]:
        raise ValueError("a quick run is no baseline: leave --quick out")
    parts = (baseline or {}).get("parts", {})
    return result | {"parts": parts | result["parts"]}


def _judge_ratios(part: dict, before: dict, quick: bool, verdict: Verdict) -> None:
    notes = {row["side"]: row["note"] for row in part["rows"] if row["median"] is None}
    for name, old in before["ratios"].items():
        new = part["ratios"].get(name)
        if new is not None:
            least = old["least"] * old["value"]
            if not new["value"] >= least:
                verdict.regressions.append(
                    f"{name}: {new['value']:.2f}, baseline {old['value']:.2f}, "
                    f"at least {least:.2f} expected"
                )
            continue
        reason = notes.get(old["against"]) or notes.get("all sides")
        reason = reason or ("left out of a quick run" if quick else None)
        if reason:
            verdict.remarks.append(f"{name}: not measured ({reason})")
        else:
            verdict.regressions.append(f"{name}: missing")

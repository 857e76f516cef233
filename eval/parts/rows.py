"""What a measurement says: rows of a table, ratios between sides, counts of errors.

Sides are named by what they are; ours begin with "jaxplan". A side that could not be
measured has a row all the same, with a note that says why.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np


@dataclass(frozen=True)
class Row:
    """One side on one scene."""

    part: str
    scene: str
    side: str
    unit: str = ""
    median: float | None = None
    """In the unit, over the rounds; None where there is nothing but a note."""
    p10: float | None = None
    p90: float | None = None
    size: int = 1
    """Problems in a call."""
    note: str = ""
    more: dict[str, Any] = field(default_factory=dict)


class Ratio(NamedTuple):
    """How many times faster we are than a peer in the same run."""

    value: float
    least: float
    """Share of the committed value below which a run has regressed."""
    against: str
    """The peer."""


class Part(NamedTuple):
    """What a part of the benchmark found."""

    rows: list[Row]
    ratios: dict[str, Ratio]
    counts: dict[str, int]
    """Of what should not happen."""


def row_of(
    part: str,
    scene: str,
    side: str,
    unit: str,
    values: Sequence[float] | np.ndarray,
    size: int = 1,
    **more: Any,
) -> Row:
    """The row of a measurement's rounds."""
    p10, median, p90 = (float(x) for x in np.percentile(values, [10, 50, 90]))
    return Row(part, scene, side, unit, median, p10, p90, size, more=more)


def compare(rows: Iterable[Row], ours: str, least: float) -> dict[str, Ratio]:
    """Ratios of the side `ours` to every peer that was measured on the same scene.

    Speeds ("/s") are divided by the peer's, times divide it.
    """
    rows = [row for row in rows if row.median is not None]
    own = {row.scene: row for row in rows if row.side == ours}
    found = {}
    for row in rows:
        if row.side.startswith("jaxplan") or row.scene not in own:
            continue
        value = _value(own[row.scene]) / _value(row)
        if not row.unit.endswith("/s"):
            value = 1 / value
        name = f"{row.part}, {row.scene}: {ours} / {row.side}"
        found[name] = Ratio(value, least, row.side)
    return found


def show(part: Part) -> None:
    """Prints the part's tables."""
    names = max((len(r.scene) + len(r.side) for r in part.rows), default=0) + 4
    for row in part.rows:
        name = f"{row.scene}: {row.side}"
        if row.median is None:
            print(f"{name:{names}}{row.note}")
            continue
        spread = f"{_short(row.median)} ({_short(row.p10)} to {_short(row.p90)})"
        more = ", ".join(f"{k} {_short(v)}" for k, v in row.more.items())
        print(f"{name:{names}}{spread:36} {row.unit:18}{more}  {row.note}".rstrip())
    for name, ratio in part.ratios.items():
        print(f"{name}: {ratio.value:.2f}")
    for name, count in part.counts.items():
        print(f"{name}: {count}")


def _value(row: Row) -> float:
    assert row.median is not None
    return row.median


def _short(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"

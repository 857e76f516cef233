"""Tables: what a script prints, its JSON holds, and RESULTS.md shows.

A cell is a text, a number, None (there is none) or an `Estimate`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple


class Estimate(NamedTuple):
    """A figure with its 95 % interval."""

    value: float
    low: float
    high: float


Cell = str | float | int | None | Estimate | Sequence[float]


@dataclass(frozen=True)
class Table:
    """Rows under named columns; the first column names the row."""

    title: str
    columns: list[str]
    rows: list[list[Any]]
    """Of `Cell`s."""
    note: str = ""


def table(content: dict[str, Any]) -> Table:
    """A table out of JSON."""
    return Table(**content)


def markdown(table: Table) -> str:
    """The table, columns aligned, and its note."""
    rows = [table.columns, *([cell(value) for value in row] for row in table.rows)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "| " + " | ".join(map(str.ljust, row, widths)) + " |"
        for row in ([*rows[:1], ["-" * width for width in widths], *rows[1:]])
    ]
    return "\n".join(lines) + (f"\n\n{table.note}\n" if table.note else "\n")


def cell(value: Cell) -> str:
    """A cell's text: three digits, the interval in brackets."""
    if value is None:
        return "-"
    if isinstance(value, str | int):
        return str(value)
    if isinstance(value, float):
        return _digits(value)
    middle, low, high = value
    if _absent(middle):
        return "-"
    if _absent(low) or _absent(high):
        return _digits(middle)
    return f"{_digits(middle)} ({_digits(low)} to {_digits(high)})"


def _absent(value: float | None) -> bool:
    return value is None or math.isnan(value)


def _digits(value: float) -> str:
    if math.isnan(value):
        return "-"
    places = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2
    places = 4 if 0 < abs(value) < 0.1 else places
    return f"{value:.{places}f}"

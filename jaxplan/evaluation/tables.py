"""Tables of results: what a script prints, its JSON holds, and RESULTS.md shows.

A cell is a text, a number, None (there is none) or an `Estimate`.
"""

import json
import math
import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from jaxplan.data import write_atomic
from jaxplan.provenance import versions


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


@dataclass(frozen=True)
class Result:
    """What one run of a script found."""

    tables: list[Table]
    settings: dict[str, Any]
    """What was run: seeds, weights, configs."""
    shortfalls: list[str]
    """Where ours is worse than it should be."""
    quick: bool
    seconds: float

    def write(self, path: Path) -> None:
        """As JSON, with the command, the date, the load and the versions."""
        content = {
            "command": " ".join(["python", *map(shlex.quote, _arguments())]),
            "date": datetime.now(UTC).date().isoformat(),
            "load": os.getloadavg(),
            "versions": versions(),
            **asdict(self),
        }
        write_atomic(path, (json.dumps(_finite(content), indent=1) + "\n").encode())

    def show(self) -> None:
        """Prints the tables."""
        for table in self.tables:
            sys.stdout.write(f"\n{table.title}\n\n{markdown(table)}\n")
        for line in self.shortfalls:
            sys.stdout.write(f"short of the aim: {line}\n")


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


def _finite(value: Any) -> Any:
    """JSON has no NaN: it becomes null."""
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _arguments() -> list[str]:
    """The command line, with the script's path as seen from the repository."""
    script, *rest = sys.argv
    return [str(Path(*Path(script).parts[-2:])), *rest]

"""What a script found, as JSON: always with its command, the date, the load and the versions."""

import json
import math
import os
import shlex
import sys
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from jaxplan.data import write_atomic
from jaxplan.evaluation.tables import Table, markdown
from jaxplan.provenance import versions


def write_result(
    path: Path, found: dict[str, Any], peers: dict[str, str] | None = None
) -> None:
    """Writes JSON, whole or not at all.

    Args:
        path: Where to; its directory is made.
        found: What the script has to say; NaN becomes null.
        peers: Versions of what is compared with, beside our own.
    """
    content = {
        "command": " ".join(["python", *map(shlex.quote, _arguments())]),
        "date": datetime.now(UTC).date().isoformat(),
        "load": os.getloadavg(),
        "versions": versions() | (peers or {}),
        **found,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, (json.dumps(_finite(content), indent=1) + "\n").encode())


@dataclass(frozen=True)
class Result:
    """What one run of a study found."""

    tables: list[Table]
    settings: dict[str, Any]
    """What was run: seeds, weights, configs."""
    shortfalls: list[str]
    """Where ours is worse than it should be."""
    quick: bool
    seconds: float

    def write(self, path: Path) -> None:
        """As JSON."""
        write_result(path, asdict(self))

    def show(self) -> None:
        """Prints the tables."""
        for table in self.tables:
            sys.stdout.write(f"\n{table.title}\n\n{markdown(table)}\n")
        for line in self.shortfalls:
            sys.stdout.write(f"short of the aim: {line}\n")


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

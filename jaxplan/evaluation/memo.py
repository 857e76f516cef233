"""Pieces of a long measurement, kept on disk: a killed run goes on where it was."""

import hashlib
import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from jaxplan.data import intact, sealed, write_atomic

PLANNING = ("planning",)
SAMPLING = (*PLANNING, "samplers", "diffusion", "networks", "learning")
"""Packages whose code decides what a piece's result is. Not `collision`: its verdicts are C
MuJoCo's, however they are computed. Delete the pieces after a change to what collides."""


class Memo:
    """`memo(settings, make)`: the JSON result of `make()`, made once for given settings.

    Args:
        directory: Where pieces lie, each in a file of its own.
    """

    def __init__(self, directory: Path = Path("runs/pieces")) -> None:
        self._directory = directory

    def __call__(self, settings: dict[str, Any], make: Callable[[], Any]) -> Any:
        """Reads the result if it is there and whole; else makes it."""
        key = json.dumps(settings, sort_keys=True)
        path = self._directory / f"{hashlib.sha256(key.encode()).hexdigest()[:24]}.json"
        if path.is_file():
            try:
                stored = json.loads(path.read_text(encoding="utf-8"))
                if intact(stored) and stored["key"] == key:
                    return stored["result"]
            except (ValueError, AttributeError):
                pass  # damaged: made again
        result = make()
        piece = sealed({"key": key, "result": result})
        write_atomic(path, json.dumps(piece).encode())
        return result


@cache
def code_digest(packages: tuple[str, ...] = SAMPLING) -> str:
    """Of their source, for the settings: a change to a planner is another measurement."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for name in packages:
        for file in sorted((package / name).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]

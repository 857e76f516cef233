"""Pieces of a long measurement, kept on disk: a killed run goes on where it was."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jaxplan.data import write_atomic

COMPUTES = ("planning", "collision", "samplers", "diffusion", "networks", "scene")
"""Packages whose code decides what a piece's result is."""


class Memo:
    """`memo(settings, make)`: the JSON result of `make()`, made once for given settings.

    Args:
        directory: Where pieces lie, each in a file of its own.
    """

    def __init__(self, directory: Path = Path("runs/pieces")) -> None:
        self._directory, self._code = directory, code_digest()

    def __call__(self, settings: dict[str, Any], make: Callable[[], Any]) -> Any:
        """Reads the result if it is there, whole and of the present code; else makes it."""
        key = json.dumps(settings | {"code": self._code}, sort_keys=True)
        path = self._directory / f"{hashlib.sha256(key.encode()).hexdigest()[:24]}.json"
        if path.is_file():
            try:
                stored = json.loads(path.read_text(encoding="utf-8"))
                if stored["key"] == key:
                    return stored["result"]
            except (ValueError, KeyError, TypeError):
                pass  # damaged: made again
        result = make()
        write_atomic(path, json.dumps({"key": key, "result": result}).encode())
        return result


def code_digest() -> str:
    """Of the source in `COMPUTES`: a change to a planner is another measurement."""
    digest = hashlib.sha256()
    package = Path(__file__).parents[1]
    for name in COMPUTES:
        for file in sorted((package / name).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]

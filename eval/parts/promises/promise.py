"""What a promise is."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

Trial = Callable[[range], list[str]]
"""Trials of some numbers; a line for each fault. The same number is the same trial."""


class Promise(NamedTuple):
    """Something that must not happen."""

    number: str
    """Of the figure, such as R10."""
    what: str
    count: int
    """Trials that make the figure."""
    piece: int
    """Trials that are kept together."""
    prepare: Callable[[Path], Trial]
    """Given an empty directory."""
    peers: str = "-"
    """What was measured of them."""

"""How a task's episodes begin, in words and numbers: for the cards of data sets."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple


class Starts(NamedTuple):
    """What is drawn at random at the start of an episode."""

    ranges: Mapping[str, tuple[float, float]]
    """By the name of a coordinate: it is uniform between these."""
    choices: Mapping[str, tuple[str, ...]]
    """By name: one of these, each as often as the others."""
    others: Mapping[str, Any]
    """What is small, JSON-ready."""
    of: Callable[[int], Mapping[str, float | str]]
    """A seed's coordinates and choices, by name."""

    def described(self) -> dict[str, Any]:
        """All of it, JSON-ready."""
        spans = {
            name: [round(low, 4), round(high, 4)]
            for name, (low, high) in self.ranges.items()
        }
        lists = {name: list(words) for name, words in self.choices.items()}
        return spans | lists | dict(self.others)

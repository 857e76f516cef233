"""Some of what there is, by their names on the command line."""

from collections.abc import Collection, Mapping
from typing import TypeVar

T = TypeVar("T")


def named(field: str, known: Mapping[str, T], names: Collection[str]) -> list[T]:
    """Those of some names, in the order of what there is.

    Raises:
        ValueError: There is none of a name; `field` is the setting that has it.
    """
    if unknown := {*names} - {*known}:
        there = ", ".join(known)
        raise ValueError(f"{field} {', '.join(sorted(unknown))}: there is {there}")
    return [value for name, value in known.items() if name in names]

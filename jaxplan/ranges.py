"""What a setting may be, said by its type: a `Positive` that is not is refused by name.

    @dataclass(frozen=True)
    class Config(Checked):
        resolution: Positive = 0.01

    check("speed", speed, Positive)

NaN and infinities are no numbers here, and neither are booleans.
"""

import types
import typing
from collections.abc import Callable
from functools import cache
from numbers import Integral, Real
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np

LONGEST = 60
"""Letters of a value in a message."""


class Range(NamedTuple):
    """Numbers that a setting may have."""

    words: str
    holds: Callable[[Any], bool]


MOST = float(np.finfo(np.float32).max)
"""What is more than this is infinite to the search."""

LEAST = float(np.finfo(np.float32).tiny)
"""What is less than this is 0 to it."""

Number = Annotated[float, Range("finite", lambda x: True)]
Positive = Annotated[float, Range("more than 0", lambda x: x >= LEAST)]
NotNegative = Annotated[float, Range("0 or more", lambda x: x >= 0)]
Step = Annotated[float, Range("at least 1e-6", lambda x: x >= 1e-6)]
"""A gap: there are as many as fit, so that it cannot be as small as one likes."""
StepOrOff = Annotated[
    float, Range("at least 1e-6, or 0", lambda x: x == 0 or x >= 1e-6)
]
Probability = Annotated[float, Range("0 to 1", lambda x: 0 <= x <= 1)]
Share = Annotated[float, Range("more than 0, at most 1", lambda x: 0 < x <= 1)]
Count = Annotated[int, Range("1 to 2^31 - 1", lambda x: 1 <= x < 2**31)]
Whole = Annotated[int, Range("0 to 2^31 - 1", lambda x: 0 <= x < 2**31)]


class Checked:
    """A dataclass whose fields are checked by their types when it is made."""

    def __post_init__(self) -> None:
        """Checks every field.

        Raises:
            ValueError: A field with a value that makes no sense, by name.
        """
        for name, kind in kinds(type(self)).items():
            check(name, getattr(self, name), kind)


@cache
def kinds(config: type) -> dict[str, Any]:
    """The types of a dataclass's fields, ranges included."""
    hints = typing.get_type_hints(config, include_extras=True)
    return {name: hints[name] for name in config.__dataclass_fields__}


def check(name: str, value: Any, kind: Any) -> None:
    """Refuses what is not of a kind.

    Args:
        name: Of the setting, for the message.
        value: As given.
        kind: A type: a range of this module, `bool`, `int`, `float`, `str`, a class, a
            `Literal`, or tuples and unions of these.

    Raises:
        ValueError: It is none.
    """
    if not _fits(value, kind):
        raise ValueError(f"{name} {shown(value)}, expected {_words(kind)}")


def shown(value: Any) -> str:
    """What was given, short and in one line."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # Python writes no integer of thousands of digits
        text = f"a very long {type(value).__name__}"
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _fits(value: Any, kind: Any) -> bool:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        return _fits(value, inner[0]) and all(r.holds(value) for r in _ranges(kind))
    if origin is Literal:
        return isinstance(value, str) and value in inner
    if origin in (typing.Union, types.UnionType):
        return any(_fits(value, one) for one in inner)
    if origin is tuple:
        if not isinstance(value, tuple):
            return False
        each = inner[:1] * len(value) if inner[-1] is Ellipsis else inner
        return len(value) == len(each) and all(map(_fits, value, each))
    if kind is bool:
        return isinstance(value, bool | np.bool_)
    if kind is int:
        return isinstance(value, Integral) and not isinstance(value, bool)
    if kind is float:
        return (
            isinstance(value, Real)
            and not isinstance(value, bool)
            and bool(abs(value) <= MOST)  # type: ignore[operator]
        )
    return isinstance(value, kind)


def _ranges(kind: Any) -> list[Range]:
    """Of a type, beside what it may say to others, such as a parser of command lines."""
    return [mark for mark in kind.__metadata__ if isinstance(mark, Range)]


def _words(kind: Any) -> str:
    """A kind in words: "a number more than 0"."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        return ", ".join([_words(inner[0]), *(r.words for r in _ranges(kind))])
    if origin is Literal:
        return " or ".join(map(repr, inner))
    if origin in (typing.Union, types.UnionType):
        return ", or ".join(map(_words, inner))
    if origin is tuple:
        if inner[-1] is Ellipsis:
            return f"a tuple, each of it {_words(inner[0])}"
        return f"a tuple of {' and '.join(map(_words, inner))}"
    words = {bool: "True or False", int: "an integer", float: "a number", str: "a text"}
    return "None" if kind is type(None) else words.get(kind, f"a {kind.__name__}")


def numbers(name: str, value: Any) -> np.ndarray:
    """An array of real numbers as float64; NaN and infinities pass.

    Raises:
        ValueError: It is none: ragged, or of texts, booleans or complex numbers.
    """
    try:
        array = np.asarray(value)
        whole = array.dtype == object and all(
            isinstance(x, Real) and not isinstance(x, bool) for x in array.flat
        )
        if array.dtype.kind in "bSUOcmM" and not whole:
            raise TypeError(f"{shown(value)}")
        return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is not an array of numbers: {error}") from None

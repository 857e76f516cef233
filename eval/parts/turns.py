"""Sides that take turns.

A busy machine then slows all of them alike, and what counts is the ratio. Compilation is
timed apart, and the cores that a side really got are measured too.
"""

import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np
from tqdm import tqdm

from jaxplan.collision import XLA_OPTIONS
from parts.rows import Row, row_of

SLOW = 0.1
"""A side that takes longer [s] fills the caches by itself."""


class Side(NamedTuple):
    """Something to measure."""

    name: str
    call: Callable[[], Any]
    """Answers `size` problems; returns when done."""
    size: int
    compile_seconds: float | None = None


def take_turns(
    part: str, scene: str, unit: str, sides: Sequence[Side], rounds: int
) -> list[Row]:
    """Measures each side once a round.

    Args:
        part: For the rows.
        scene: For the rows.
        unit: What is answered, "/s" included.
        sides: Who answers.
        rounds: How often.
    """
    rates, busy = np.zeros((2, len(sides), rounds))
    warm = [True] * len(sides)
    for side in sides:
        side.call()
    for turn in tqdm(range(rounds), desc=f"{part}, {scene}", unit="round"):
        for index, side in enumerate(sides):
            if warm[index]:
                side.call()  # the one before left the caches to itself
            wall, cpu = time.perf_counter(), time.process_time()
            side.call()
            seconds = time.perf_counter() - wall
            rates[index, turn] = side.size / seconds
            busy[index, turn] = (time.process_time() - cpu) / seconds
            warm[index] = seconds < SLOW
    rows = []
    for side, rate, cores in zip(sides, rates, busy, strict=True):
        more = {"cores": round(float(np.median(cores)), 2)}
        if side.compile_seconds is not None:
            more["compile_seconds"] = side.compile_seconds
        rows.append(row_of(part, scene, side.name, unit, rate, side.size, **more))
    return rows


def compiled(
    function: Callable, *arguments: Any, options: dict[str, Any] = XLA_OPTIONS
) -> tuple[Callable[[], Any], float]:
    """The function ready to call on the arguments, and how long compilation took [s]."""
    start = time.perf_counter()
    lowered = jax.jit(function).lower(*arguments)
    program = lowered.compile(compiler_options=options)
    seconds = time.perf_counter() - start
    return lambda: jax.block_until_ready(program(*arguments)), seconds

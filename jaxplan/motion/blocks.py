"""Any number of rows by programs of few sizes: another number of them compiles nothing."""

from collections.abc import Callable
from typing import Any

import jax
import numpy as np

SIZES = 1, 16, 256
"""Rows of a call: the least of these that has room; of more rows there are more calls."""


def in_blocks(function: Callable[..., jax.Array], *rows: Any) -> np.ndarray:
    """What a compiled function says of each row.

    Args:
        function: `(*rows) -> [n]`, each row for itself.
        rows: Pytrees with leaves `[n, ...]`, NumPy.

    Returns:
        `[n]` float32.
    """
    count, most = len(jax.tree.leaves(rows)[0]), SIZES[-1]
    answers = [np.zeros(0, np.float32)]
    for first in range(0, count, most):
        part = np.arange(first, min(first + most, count))
        padded = np.resize(part, next(size for size in SIZES if size >= len(part)))
        block = jax.tree.map(lambda leaf, at=padded: leaf[at], rows)
        answers.append(np.asarray(function(*block))[: len(part)])
    return np.concatenate(answers)

"""A network row by row: at another batch size it differs in the last bits."""

from collections.abc import Callable
from typing import Any

import jax


def row_by_row(function: Callable[..., Any]) -> Callable[..., Any]:
    """`function` of trees of `[B, ...]`, whose answer for a row depends on that row alone."""

    def one(row: Any) -> Any:
        alone = function(*jax.tree.map(lambda leaf: leaf[None], row))
        return jax.tree.map(lambda leaf: leaf[0], alone)

    return lambda *batch: jax.lax.map(one, batch)

"""Paths of plans made shorter by straight lines, many at a time."""

import dataclasses
from collections.abc import Sequence

import jax
import numpy as np

from jaxplan.collision import World
from jaxplan.config import TrajectoryConfig
from jaxplan.motion.batch import keys_of
from jaxplan.motion.plan import Plan
from jaxplan.motion.search import Search
from jaxplan.trajectory import Validation, shortcut


def shortened(
    plans: Sequence[Plan],
    search: Search,
    config: TrajectoryConfig,
    circular: np.ndarray,
) -> list[Plan]:
    """Solved plans with a path that is no longer; others as they are.

    Each depends on its own path, seed and world only.
    """
    solved = [row for row, plan in enumerate(plans) if plan.solved]
    if not solved:
        return list(plans)
    # Of a size that compiles seldom.
    size = 1 << (len(solved) - 1).bit_length()
    padded = [plans[row] for row in np.resize(solved, size)]
    worlds: World = jax.tree.map(lambda *x: np.stack(x), *[p.world for p in padded])
    validation = Validation(
        lambda problem, q: search.free_rows(worlds, problem, q),
        lambda problem, q, motion: search.free_rows(worlds, problem, q, motion),
        config.check_rows,
        config.check_resolution,
    )
    paths = [np.asarray(plans[row].path, np.float64) for row in solved]
    keys = keys_of([plans[row].seed for row in solved])
    found = list(plans)
    short = shortcut(paths, keys, validation, config, circular)
    for row, path in zip(solved, short, strict=True):
        found[row] = dataclasses.replace(plans[row], path=path.astype(np.float32))
    return found

"""Rows of problems in, paths out: padded to sizes that compile seldom, shared among threads."""

import math
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import jax
import numpy as np

from jaxplan.collision import World
from jaxplan.motion.sampling import Proposals
from jaxplan.motion.search import Search
from jaxplan.planning import PlanResult


class Batch(NamedTuple):
    """P of them, checked."""

    q_start: np.ndarray
    """`[P, d]` [rad or m]."""
    q_goals: np.ndarray
    """`[P, G, d]` each as good as the other [rad or m]."""
    seeds: Sequence[int]
    world: World
    own: bool
    """Leaves of the world have a leading axis P."""


class BatchSearch:
    """Answers problems, many at a time.

    Args:
        search: Of the scene.
        proposals: Learned segments; without them all are uniform.
    """

    def __init__(self, search: Search, proposals: Proposals | None) -> None:
        self._search, self._proposals = search, proposals

    def __call__(self, asked: Batch, time_limit: float = math.inf) -> PlanResult:
        """Answers P problems, in NumPy; what is open after `time_limit` [s] is TIME_OUT."""
        parts, halt = _parts(len(asked.seeds)), threading.Event()
        search = partial(self._search_rows, asked, time_limit, halt.is_set)
        if len(parts) == 1:
            return search(parts[0])
        with ThreadPoolExecutor(len(parts)) as pool:
            try:
                answers = list(pool.map(search, parts))
            except BaseException:  # Ctrl-C too: the threads end with their slice
                halt.set()
                raise
        order = np.argsort(np.concatenate(parts))
        return jax.tree.map(lambda *leaves: np.concatenate(leaves)[order], *answers)

    def _search_rows(
        self,
        asked: Batch,
        time_limit: float,
        stopped: Callable[[], bool],
        rows: np.ndarray,
    ) -> PlanResult:
        """Searches some of the rows, padded to a size that compiles seldom."""
        count = len(rows)
        size = count if count == 1 else max(16, 1 << (count - 1).bit_length())
        padded = np.resize(rows, size)
        keys = _keys(np.array([asked.seeds[row] for row in padded], np.uint32))
        start, goals, world = asked.q_start[padded], asked.q_goals[padded], asked.world
        if asked.own:
            world = jax.tree.map(lambda leaf: np.asarray(leaf)[padded], world)
        goal = goals[:, 0]
        result = self._search(asked.own)(
            world,
            start,
            goal,
            goal,
            keys,
            self._proposals and self._proposals(start, goal, keys, world),
            np.arange(size) < count,
            goals[:, 1:],
            time_limit,
            stopped,
        )
        return jax.tree.map(lambda leaf: np.asarray(leaf)[:count], result)


@jax.jit
def _keys(seeds: jax.Array) -> jax.Array:
    return jax.vmap(jax.random.key)(seeds)


def keys_of(seeds: Sequence[int]) -> jax.Array:
    """`[P]` typed keys."""
    return _keys(np.array(seeds, np.uint32))


def _parts(count: int) -> list[np.ndarray]:
    """Rows of each thread: XLA on CPU keeps one core and a half busy with a search.

    Two threads a core, because hard problems make some end much later than others;
    interleaving shares these fairly.
    """
    cores = os.cpu_count() or 1
    wanted = min(2 * cores, count // 16) if jax.default_backend() == "cpu" else 1
    threads = max(wanted, 1)
    return [np.arange(count)[i::threads] for i in range(threads)]

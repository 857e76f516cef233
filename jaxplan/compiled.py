"""The compiled search of a planner: rows of questions in, paths out."""

import math
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.config import PlannerConfig
from jaxplan.ik import Limits
from jaxplan.planning import PlanResult, Segment, make_planner
from jaxplan.scene import Scene

Sampler = Callable[[jax.Array, jax.Array, jax.Array, int], Segment]
"""`(key, q_start [d], q_goal [d], count) -> Segment [count]`: tree-extension segments for a
problem, with the configurations where they begin or without; traced by JAX."""

BANK = 64
"""Segments that a sampler is asked for at a time."""

jit: Any = partial(jax.jit, compiler_options=collision.XLA_OPTIONS)


class Questions(NamedTuple):
    """P of them, checked."""

    q_start: np.ndarray
    """`[P, d]` [rad or m]."""
    q_goals: np.ndarray
    """`[P, G, d]` each as good as the other [rad or m]."""
    seeds: Sequence[int]
    world: World
    own: bool
    """Leaves of the world have a leading axis P."""


class Compiled:
    """What compiles once for a scene and settings.

    Args:
        scene: What can touch what.
        config: Settings of the search.
        limits: Of the joints.
        sampler: Proposes segments; without it all proposals are uniform.
    """

    def __init__(
        self,
        scene: Scene,
        config: PlannerConfig,
        limits: Limits,
        sampler: Sampler | None,
    ) -> None:
        self._scene, self._config = scene, config
        self._limits, self._sampler = limits, sampler
        self._searches: dict[bool, Callable[..., PlanResult]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """A copy is without programs."""
        kept = "_scene", "_config", "_limits", "_sampler"
        return {name: getattr(self, name) for name in kept} | {"_searches": {}}

    @cached_property
    def clearance(self) -> Callable[[World, np.ndarray], jax.Array]:
        """`(world, q) -> [...]` [m]."""
        return jit(lambda world, q: collision.clearance(self._scene, world, q))

    @cached_property
    def free(self) -> Callable[..., jax.Array]:
        """`(world, q) -> [...]` bool; `(world, q, motion)`: proven free all around."""
        return jit(self._config_free)

    def search(self, asked: Questions, time_limit: float = math.inf) -> PlanResult:
        """Answers P questions, in NumPy; what is open after `time_limit` [s] is TIME_OUT."""
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
        asked: Questions,
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
            None if self._sampler is None else self._draw(keys, start, goal),
            np.arange(size) < count,
            goals[:, 1:],
            time_limit,
            stopped,
        )
        return jax.tree.map(lambda leaf: np.asarray(leaf)[:count], result)

    def _config_free(
        self, world: World, q: jax.Array, motion: jax.Array | None = None
    ) -> jax.Array:
        margin = self._config.margin
        return collision.config_free(self._scene, world, q, margin, motion=motion)

    def _search(self, own: bool) -> Callable[..., PlanResult]:
        """The compiled search; `own`: each problem has a world of its own."""
        if own not in self._searches:

            def free(worlds: World, problem: jax.Array, *q: jax.Array) -> jax.Array:
                world = (
                    jax.tree.map(lambda leaf: leaf[problem], worlds) if own else worlds
                )
                return self._config_free(world, *q)

            q_min, q_max, circular = self._limits
            self._searches[own] = make_planner(
                free, self._config, q_min, q_max, jit, circular, free
            )
        return self._searches[own]

    def _draw(
        self, keys: jax.Array, start: np.ndarray, goal: np.ndarray
    ) -> Callable[[jax.Array], Segment]:
        return lambda chunk: self._banks(keys, chunk, start, goal)

    @cached_property
    def _banks(self) -> Callable[..., Segment]:
        count = max(BANK, self._config.workers)

        def bank(key, chunk, q_start, q_goal):
            # Apart from the numbers of the search, which fold in expansions from 0 on.
            key = jax.random.fold_in(jax.random.fold_in(key, 2**31), chunk)
            assert self._sampler is not None
            segment = Segment(*self._sampler(key, q_start, q_goal, count))
            many = count, len(q_start)
            expected = {"direction": many, "length": (count,), "base": many}
            for name, leaf in segment._asdict().items():
                if leaf is not None and jnp.shape(leaf) != expected[name]:
                    raise ValueError(
                        f"the sampler's {name} has shape {jnp.shape(leaf)}, "
                        f"expected {expected[name]}"
                    )
            return segment

        return jit(jax.vmap(bank))


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

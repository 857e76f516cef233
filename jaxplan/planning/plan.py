"""The door to planning: checks what it is given, runs the search, refills the bank.

    plan = make_planner(config_free, config, q_min, q_max)
    result = plan(worlds, q_start, q_goal, q_toggle, keys, draw)

Everything compiles once for a batch size P and a bank size M. `worlds` is an argument of the
compiled pieces, so a world may change from call to call; a batch that is short of problems is
padded and `active` says which lanes are real.
"""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from jaxplan.config import PlannerConfig
from jaxplan.planning import lanes, search
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.segment import Segment
from jaxplan.planning.settings import check_settings
from jaxplan.planning.state import Query

Worlds = Any


def make_planner(
    config_free: Callable[[Worlds, jax.Array, jax.Array], jax.Array],
    config: PlannerConfig,
    q_min: ArrayLike,
    q_max: ArrayLike,
    jit: Callable[[Callable], Callable] = jax.jit,
) -> Callable[..., PlanResult]:
    """Builds a planner for batches of problems.

    Args:
        config_free: `(worlds, problem [R], q [R, d]) -> [R]`: whether configurations are
            free, row r in the world of problem `problem[r]`.
        config: Planner settings.
        q_min: `[d]` lower joint limits [rad].
        q_max: `[d]` upper joint limits [rad].
        jit: Compiles the pieces; give compiler options here.

    Returns:
        `plan(worlds, q_start [P, d], q_goal [P, d], q_toggle [P, d], keys [P], draw=None,
        active=None) -> PlanResult`. `draw(chunk [P]) -> Segment [P, M]` gives the learned
        segments `chunk * M` to `chunk * M + M - 1` of each problem; without it all
        proposals are uniform. It is asked when a search asks for a segment (the very first
        call also asks to see how large M is). `active [P]` is false for padding lanes.

    Raises:
        ValueError: A setting or a limit that makes no sense, or arrays of the wrong shape.
    """
    q_min, q_max = np.asarray(q_min, np.float32), np.asarray(q_max, np.float32)
    check_settings(config, q_min, q_max)
    d = q_min.size

    def run(
        worlds: Worlds,
        state: lanes.Lanes,
        query: Query,
        status: jax.Array,
        bank: Segment | None,
    ) -> lanes.Lanes:
        def free(problem, q):
            return config_free(worlds, problem, q)

        return lanes.run(state, query, status, bank, free, _limits(), config)

    def begin(query: Query, active: jax.Array, count: int):
        query, status = search.examine(query, _limits())
        status = jnp.where(active, status, Status.INACTIVE).astype(jnp.int32)
        return lanes.begin(query, status, count, config), query, status

    @jit
    def uniform(worlds: Worlds, query: Query, active: jax.Array) -> PlanResult:
        """The whole search in one program."""
        count = min(len(active), config.lanes)
        state, query, status = begin(query, active, count)
        return run(worlds, state, query, status, None).answers

    @jit
    def start(query: Query, active: jax.Array):
        # A lane for each problem: the sampler's banks are by problem. There is none yet.
        state, query, status = begin(query, active, len(active))
        chunk = jnp.full_like(state.state.chunk, -1)
        return state._replace(state=state.state._replace(chunk=chunk)), query, status

    guided = jit(run)
    rows: list[int] = []
    """M, once a bank was seen."""

    def _limits():
        return jnp.asarray(q_min), jnp.asarray(q_max)

    def plan(
        worlds: Worlds, q_start, q_goal, q_toggle, keys, draw=None, active=None
    ) -> PlanResult:
        unbounded: Any = np.full(len(keys), np.inf, np.float32)
        query = Query(
            _batch(q_start, d, "q_start"),
            _batch(q_goal, d, "q_goal"),
            _batch(q_toggle, d, "q_toggle"),
            keys,
            unbounded,
        )
        problems = len(query.q_start)
        if {len(q) for q in query} != {problems}:
            sizes = [len(q) for q in query[:4]]
            raise ValueError(f"q_start, q_goal, q_toggle, keys have lengths {sizes}")
        active = np.ones(problems, bool) if active is None else np.asarray(active, bool)
        if draw is None or config.p_uniform >= 1:
            return uniform(worlds, query, active)
        state, query, status = start(query, active)
        if not rows:
            rows.append(draw(jnp.zeros(problems, jnp.int32)).length.shape[1])
        if rows[0] < config.workers:
            raise ValueError(
                f"a bank of {rows[0]} segments for {config.workers} workers"
            )
        # Nobody reads it: whoever asks for a segment waits for the first bank.
        shape = problems, rows[0]
        bank = Segment(jnp.zeros((*shape, d)), jnp.zeros(shape))
        while True:
            state = guided(worlds, state, query, status, bank)
            if not np.asarray(state.state.waiting).any():
                return state.answers
            bank = draw(state.state.chunk)

    return plan


def _batch(q, d: int, name: str) -> Any:
    q = np.asarray(q, np.float32)
    if q.ndim != 2 or q.shape[1] != d:
        raise ValueError(f"{name} has shape {q.shape}, expected (problems, {d})")
    return q

"""The door to planning: checks what it is given, runs the search, refills the bank.

    plan = make_planner(config_free, config, q_min, q_max)
    result = plan(worlds, q_start, q_goal, q_toggle, keys, draw)

Everything compiles once for a batch size P and a bank size M. `worlds` is an argument of the
compiled pieces, so a world may change from call to call; a batch that is short of problems is
padded and `active` says which lanes are real.

A search runs in slices of a fraction of a second, so that it can be stopped in between: by
a time limit, by the caller, or by Ctrl-C. How it is sliced changes nothing in the answer.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from jaxplan.config import PlannerConfig
from jaxplan.planning import ends, lanes
from jaxplan.planning.methods import method_of
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.segment import DrawBank, Segment
from jaxplan.planning.settings import check_settings
from jaxplan.planning.space import Space
from jaxplan.planning.state import Problem

Worlds = Any
FIRST_SLICE = 32
"""Rounds of a search before anything is known of how long they take."""
SLICE = 0.1
"""How long a slice is to take [s]."""
LAST_SLICE = 0.02
"""The same where a time limit is near [s]."""


def make_planner(
    config_free: Callable[[Worlds, jax.Array, jax.Array], jax.Array],
    config: PlannerConfig,
    q_min: ArrayLike,
    q_max: ArrayLike,
    jit: Callable[..., Callable] = jax.jit,
    circular: ArrayLike | None = None,
    swept_free: Callable[..., jax.Array] | None = None,
) -> Callable[..., PlanResult]:
    """Builds a planner for batches of problems.

    Args:
        config_free: `(worlds, problem [R], q [R, d]) -> [R]`: whether configurations are
            free, row r in the world of problem `problem[r]`.
        config: Planner settings.
        q_min: `[d]` lower joint limits [rad], -inf where there is none.
        q_max: `[d]` upper joint limits [rad], inf where there is none.
        jit: Compiles the pieces; give compiler options here.
        circular: `[d]` joints that come round: q and q + 2 pi are the same. A path turns
            on through them, and ends at q_goal or some turns from it.
        swept_free: `(worlds, problem [R], q [R, d], motion [R, d]) -> [R]`: whether all
            configurations within `motion` of q, joint by joint, are proven free. With it
            the path that is found is free all along, not at samples only.

    Returns:
        `plan(worlds, q_start [P, d], q_goal [P, d], q_toggle [P, d], keys [P], draw=None,
        active=None, goals=None, time_limit=inf, stopped=None) -> PlanResult`.
        `draw` is a `DrawBank`; bank c holds segments `c * M` to `c * M + M - 1` of each
        problem; without it all proposals are uniform. It is
        asked when a search asks for a segment (the very first call also asks to see how
        large M is). `active [P]` is false for padding lanes. `goals [P, G - 1, d]` are as
        good as q_goal (`rrt_connect` only). What is not solved after `time_limit` [s], or
        when `stopped()` says so, is TIME_OUT.

    Raises:
        ValueError: A setting or a limit that makes no sense, or arrays of the wrong shape.
    """
    space = Space.of(q_min, q_max, circular, config.metric)
    d = space.q_min.size
    check_settings(config, d)
    pace = math.inf
    """How long a round took in the last slice [s]."""

    def run(
        worlds: Worlds,
        state: lanes.Lanes,
        new: jax.Array,
        problems: Problem,
        active: jax.Array,
        bank: Segment | None,
        rounds: jax.Array,
        stop: jax.Array,
    ) -> lanes.Lanes:
        problems, status = ends.examine(problems, space)
        status = jnp.where(active, status, Status.INACTIVE).astype(jnp.int32)
        state = lanes.begin(state, new, problems, status, space, config)
        if bank is not None:  # there is none yet
            bank_number = jnp.where(new, -1, state.state.bank_number)
            state = state._replace(state=state.state._replace(bank_number=bank_number))

        def free(problem, q):
            return config_free(worlds, problem, q)

        def swept(problem, q, motion):
            assert swept_free is not None
            return swept_free(worlds, problem, q, motion)

        proof = None if swept_free is None else swept
        return lanes.run(
            state, problems, status, bank, free, proof, rounds, stop, space, config
        )

    @jit
    def empty(problems: Problem, bank: Segment | None) -> lanes.Lanes:
        # With a bank a lane for each problem: the sampler's banks are by problem.
        count = len(problems.q_start)
        rows = count if bank is not None else min(count, config.lanes)
        return lanes.empty(problems, rows, space, config)

    advance = jit(run, donate_argnums=1)
    used: dict[tuple[int, ...], list[lanes.Lanes]] = {}
    """Lanes of single problems that are over: getting memory is a good part of a search."""
    seen: list[tuple[int, bool]] = []
    """M, and whether segments have bases, once a bank was seen."""

    def first_bank(draw: DrawBank | None, count: int) -> Any:
        """A bank that nobody reads: whoever asks for a segment waits for the first one."""
        if draw is None or config.p_uniform >= 1:
            return None
        if not seen:
            bank = draw(jnp.zeros(count, jnp.int32))
            seen.append((bank.length.shape[1], bank.base is not None))
        rows, based = seen[0]
        if rows < config.workers:
            raise ValueError(f"a bank of {rows} segments for {config.workers} workers")
        q = jnp.zeros((count, rows, d))
        return Segment(q, q[..., 0], q if based else None)

    def plan(
        worlds: Worlds,
        q_start,
        q_goal,
        q_toggle,
        keys,
        draw=None,
        active=None,
        goals=None,
        time_limit: float = math.inf,
        stopped: Callable[[], bool] | None = None,
    ) -> PlanResult:
        nonlocal pace
        end = time.perf_counter() + time_limit
        problems = _problems(q_start, q_goal, q_toggle, keys, goals, d)
        count = len(problems.q_start)
        if problems.goals.shape[1] and not method_of(config).goal_sets:
            raise ValueError(f"{config.method} has one goal; several need rrt_connect")
        active = np.ones(count, bool) if active is None else np.asarray(active, bool)
        bank = first_bank(draw, count)
        kept = used.setdefault((count, problems.goals.shape[1], bank is None), [])
        state = kept.pop() if kept else empty(problems, bank)
        new, go, halt = np.True_, np.False_, np.True_

        def over(state: lanes.Lanes) -> PlanResult:
            answers = jax.tree.map(np.array, state.answers)
            if count == 1:
                kept.append(state)
            return answers

        while True:
            began = time.perf_counter()
            left = end - began
            wanted = SLICE if left > 2 * SLICE else min(LAST_SLICE, left / 2)
            rounds = FIRST_SLICE if math.isinf(pace) else wanted / pace
            rounds = np.int32(np.clip(rounds, 1, 2**30))
            state = advance(worlds, state, new, problems, active, bank, rounds, go)
            new = np.False_
            problem = np.asarray(state.problem)
            open_ = problem < count
            if not open_.any():
                return over(state)
            if np.asarray(state.state.waiting).any():
                assert draw is not None
                bank = draw(state.state.bank_number)
            now = time.perf_counter()
            pace = max((now - began) / rounds, 1e-7)
            if now >= end or (stopped is not None and stopped()):
                break
        late = np.zeros(count, bool)
        late[problem[open_]] = late[int(state.taken) :] = True
        last = np.int32(2**30)
        answers = over(advance(worlds, state, new, problems, active, bank, last, halt))
        late &= answers.status == Status.BUDGET_EXHAUSTED
        status = np.where(late, Status.TIME_OUT, answers.status).astype(np.int32)
        return answers._replace(status=status)

    return plan


def _problems(q_start, q_goal, q_toggle, keys, goals, d: int) -> Problem:
    """The problems, checked."""
    unbounded: Any = np.full(len(keys), np.inf, np.float32)
    problems = Problem(
        _batch(q_start, d, "q_start"),
        _batch(q_goal, d, "q_goal"),
        _batch(q_toggle, d, "q_toggle"),
        keys,
        unbounded,
        np.zeros((len(keys), 0, d), np.float32)  # type: ignore[arg-type]
        if goals is None
        else np.asarray(goals, np.float32),
    )
    count = len(problems.q_start)
    if {len(q) for q in problems} != {count}:
        sizes = [len(q) for q in problems[:4]]
        raise ValueError(f"q_start, q_goal, q_toggle, keys have lengths {sizes}")
    return problems


def _batch(q, d: int, name: str) -> Any:
    q = np.asarray(q, np.float32)
    if q.ndim != 2 or q.shape[1] != d:
        raise ValueError(f"{name} has shape {q.shape}, expected (problems, {d})")
    return q

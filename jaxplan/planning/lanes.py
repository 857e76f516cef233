"""Many problems through a few lanes: a lane whose problem is over takes the next one.

Problems differ in difficulty by orders of magnitude. In lockstep all would wait for the
hardest; here every lane is busy until the queue is empty, in one compiled loop:

    harvest   where a problem is over: check its path densely, write the answer down, load
              the next problem; where one was loaded: check its start and goal
    round     every lane goes on with its problem (`search.advance`)

A path whose dense check fails is not an answer: its problem starts anew in its lane, with
other random numbers, checks twice as fine, and what is left of its budget. So does, under
a bound, a problem that is to have a shorter path (`bounded`).
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning import ends, search
from jaxplan.planning.edges import ConfigFree
from jaxplan.planning.methods import method_of
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.segment import Segment
from jaxplan.planning.soundness import check_ends_and_paths
from jaxplan.planning.space import Space, norm
from jaxplan.planning.state import Problem, State, searching
from jaxplan.planning.sweep import SweptFree

SHORTER = 0.999
"""A search for a shorter path looks for one that is shorter by this factor at least."""


class Lanes(NamedTuple):
    """P problems in L lanes."""

    state: State
    """Of the lanes."""
    problem: jax.Array
    """`[L]` what each lane works on; P = nothing."""
    fresh: jax.Array
    """`[L]` its start and goal are still to be checked."""
    taken: jax.Array
    """Problems that some lane has taken."""
    answers: PlanResult
    """Of the problems; what is not over yet is empty."""


def empty(problems: Problem, lanes: int, space: Space, config: PlannerConfig) -> Lanes:
    """Lanes that search nothing, for problems like these.

    Args:
        problems: `[P]`.
        lanes: L, at most P.
        space: Of the configurations.
        config: Planner settings.
    """
    count, d = problems.q_start.shape
    first = jax.tree.map(lambda leaf: leaf[:lanes], problems)
    zero = jnp.zeros(count, jnp.int32)
    answers = PlanResult(
        path=jnp.zeros((count, ends.waypoints(config), d)),
        path_length=zero,
        status=zero,
        expansions=zero,
        accepted=zero,
        learned=zero,
        checks=zero,
        nodes=jnp.zeros((count, 2), jnp.int32),
    )
    return Lanes(
        state=search.empty(first, space, config),
        problem=jnp.full(lanes, count, jnp.int32),
        fresh=jnp.zeros(lanes, bool),
        taken=jnp.int32(lanes),
        answers=answers,
    )


def begin(
    lanes: Lanes,
    new: jax.Array,
    problems: Problem,
    status: jax.Array,
    space: Space,
    config: PlannerConfig,
) -> Lanes:
    """Loads the first L of P problems if they are `new`.

    Args:
        lanes: From `empty`, or of other problems that are over; else they stay as they are.
        new: Whether the problems are others than before.
        problems: `[P]`.
        status: `[P]` from `ends.examine`.
        space: Of the configurations.
        config: Planner settings.
    """
    count = len(lanes.problem)
    problem, every = jnp.arange(count, dtype=jnp.int32), jnp.ones(count, bool)
    where = every & new
    loaded = _load(problems, status, problem)
    state = search.start(lanes.state, where, *loaded, space, config)
    state = _counted_anew(state, where)
    nothing = jax.tree.map(jnp.zeros_like, lanes.answers)._replace(status=status)
    first = Lanes(state, problem, every, jnp.int32(count), nothing)
    chosen = jax.tree.map(partial(jnp.where, new), first[1:], lanes[1:])
    return Lanes(state, *chosen)


def run(
    lanes: Lanes,
    problems: Problem,
    status: jax.Array,
    bank: Segment | None,
    config_free: ConfigFree,
    swept_free: SweptFree | None,
    rounds: jax.Array,
    stop: jax.Array,
    space: Space,
    config: PlannerConfig,
) -> Lanes:
    """Goes on until all problems are answered or wait for more learned segments.

    Args:
        lanes: From `begin` or an earlier `run`.
        problems: `[P]`.
        status: `[P]` from `ends.examine`.
        bank: As for `search.advance`, of the lanes.
        config_free: The check of configurations; `problem` counts the P problems.
        swept_free: Proves configurations and what is near to them; None: paths are checked
            at samples.
        rounds: How many at most; the search goes on with the next call.
        stop: All that is not solved now is given up.
        space: Of the configurations.
        config: Planner settings.
    """
    count = len(status)

    def going(lanes: Lanes) -> jax.Array:
        return searching(lanes.state, config) & ~stop

    def able(lanes: Lanes) -> jax.Array:
        return going(lanes) & ~lanes.state.waiting & ~lanes.fresh

    def due(lanes: Lanes) -> jax.Array:
        return (lanes.fresh | ~going(lanes)) & (lanes.problem < count)

    def turn(carry: tuple[jax.Array, Lanes]) -> tuple[jax.Array, Lanes]:
        number, lanes = carry

        def harvest(lanes: Lanes) -> Lanes:
            return _harvest(
                lanes,
                due(lanes),
                problems,
                status,
                (config_free, swept_free),
                stop,
                space,
                config,
            )

        lanes = jax.lax.cond(jnp.any(due(lanes)), harvest, lambda same: same, lanes)
        here = jnp.minimum(lanes.problem, count - 1)

        def free(lane: jax.Array, q: jax.Array) -> jax.Array:
            return config_free(here[lane], q)

        state = search.advance(lanes.state, able(lanes), bank, free, space, config)
        return number + 1, lanes._replace(state=state)

    def more(carry: tuple[jax.Array, Lanes]) -> jax.Array:
        number, lanes = carry
        return (number < rounds) & jnp.any(able(lanes) | due(lanes))

    state = lanes.state._replace(waiting=jnp.zeros_like(lanes.state.waiting))
    first = jnp.int32(0), lanes._replace(state=state)
    return jax.lax.while_loop(more, turn, first)[1]


def _load(
    problems: Problem, status: jax.Array, problem: jax.Array
) -> tuple[Problem, jax.Array]:
    """Those of `problem [L]`; a lane without one has nothing to search."""
    row = jnp.minimum(problem, len(status) - 1)
    problems = jax.tree.map(lambda leaf: leaf[row], problems)
    return problems, jnp.where(problem < len(status), status[row], Status.INACTIVE)


def _harvest(
    lanes: Lanes,
    due: jax.Array,
    problems: Problem,
    status: jax.Array,
    checks: tuple[ConfigFree, SweptFree | None],
    stop: jax.Array,
    space: Space,
    config: PlannerConfig,
) -> Lanes:
    """Looks after the lanes that are `due [L]`: a new problem, or an answer to write down."""
    state, count = lanes.state, len(status)
    found = ends.finish(state, space, config)
    opening = due & lanes.fresh & (state.status == Status.BUDGET_EXHAUSTED)
    solved = due & ~lanes.fresh & (found.status == Status.SOLVED)
    sound, start_free, goal_free = check_ends_and_paths(
        state.problems, lanes.problem, found, opening, solved, checks, config
    )
    opened = jnp.where(goal_free, state.status, Status.GOAL_IN_COLLISION)
    opened = jnp.where(start_free, opened, Status.START_IN_COLLISION)
    state = state._replace(status=opened.astype(jnp.int32))
    found = found._replace(
        status=jnp.where(sound, found.status, Status.BUDGET_EXHAUSTED),
        path_length=jnp.where(sound, found.path_length, 1),
    )
    more = (state.expansions < config.max_expansions) & ~stop
    anew, bound = ~sound & more, state.problems.bound
    if method_of(config).optimises:
        # Until the budget is used, or the path is straight.
        gaps = norm(found.path[:, 1:] - found.path[:, :-1])
        bound = jnp.where(solved & sound, SHORTER * jnp.sum(gaps, axis=1), bound)
        straight = space.distance(state.problems.q_start, state.problems.q_goal)
        anew |= solved & more & (bound > straight)
    done = due & ~lanes.fresh & ~anew
    answers = _write(
        lanes, found, done, due & ~lanes.fresh & sound & solved, count, config
    )
    problem = lanes.taken + jnp.cumsum(done, dtype=jnp.int32) - 1
    problem = jnp.where(done, jnp.minimum(problem, count), lanes.problem)
    loaded = done & (problem < count)
    begins = loaded | anew
    asked, known = _load(problems, status, problem)
    asked = asked._replace(bound=jnp.where(anew, bound, jnp.inf))
    state = search.start(state, begins, asked, known, space, config)
    # A new attempt goes on counting, and so draws other random numbers.
    state = state._replace(attempt=state.attempt + (anew & ~sound))
    return Lanes(
        state=_counted_anew(state, loaded),
        problem=problem,
        fresh=loaded,
        taken=lanes.taken + jnp.sum(done, dtype=jnp.int32),
        answers=answers,
    )


def _counted_anew(state: State, where: jax.Array) -> State:
    """All counters are 0 `where [L]` a problem is another one."""
    for name in ("bank_number", "used", "expansions", "accepted", "checks", "attempt"):
        count = jnp.where(where, 0, getattr(state, name))
        state = state._replace(**{name: count})
    return state


def _write(
    lanes: Lanes,
    found: PlanResult,
    done: jax.Array,
    better: jax.Array,
    count: int,
    config: PlannerConfig,
) -> PlanResult:
    """The answers, with those of the lanes that are `done [L]`, or have a `better [L]` path."""
    first = jnp.isinf(lanes.state.problems.bound)
    path = better | (done & first) if method_of(config).optimises else done
    own = {"path": path, "path_length": path, "status": path}

    def write(name: str) -> jax.Array:
        row = jnp.where(own.get(name, done | path), lanes.problem, count)
        leaf = getattr(lanes.answers, name)
        return leaf.at[row].set(getattr(found, name), mode="drop")

    return PlanResult(*map(write, PlanResult._fields))

"""The search loop: K workers of each problem share its trees.

A round of a method (`method.Method`):

    propose    every worker from the same state of the trees
    check      the motions of all workers of all problems together (`edges`)
    commit     the free ones become nodes, in the order of the workers

With one worker this is the textbook algorithm, and `expansions` counts what the textbook
counts. More workers find a way in fewer rounds, as one block of threads each does in
pRRTC (arXiv 2503.06757), at the price of expansions that know nothing of each other.

Everything about a problem depends on its own ends, key and settings: neither on the
other problems of a batch nor on its place among them.
"""

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning import bounded, domain
from jaxplan.planning.edges import ConfigFree, motions_free
from jaxplan.planning.methods import method_of
from jaxplan.planning.proposal import draw_numbers
from jaxplan.planning.result import Status
from jaxplan.planning.segment import Segment, extend
from jaxplan.planning.space import Space, norm
from jaxplan.planning.state import Move, Outcome, Problem, State, choose
from jaxplan.planning.tree import (
    at,
    bare,
    configurations,
    distances,
    first_min,
    insert,
    nearest,
    plant,
)

NARROW = 4
"""Workers of a problem's first rounds."""
WIDENING = 16
"""There is one worker to so many expansions that went before, up to all of them."""
FINEST = 8
"""Halvings of the resolution at most."""
LEAST_ROWS = 32
"""Configurations of one call: it costs as much before its first one as some thirty do."""


def empty(problems: Problem, space: Space, config: PlannerConfig) -> State:
    """A state that searches nothing, for problems like these `[P]`."""
    count, joints = problems.q_start.shape
    zero = jnp.zeros(count, jnp.int32)
    roots = method_of(config).roots(problems).shape[1]
    return State(
        problems=problems,
        tree=bare(count, joints, config.max_expansions + roots),
        control=method_of(config).begin(problems, space, config),
        status=jnp.full(count, int(Status.INACTIVE), jnp.int32),
        waiting=jnp.zeros_like(zero, bool),
        bank_number=zero,
        used=zero,
        expansions=zero,
        accepted=zero,
        checks=zero,
        attempt=zero,
    )


def start(
    state: State,
    where: jax.Array,
    problems: Problem,
    status: jax.Array,
    space: Space,
    config: PlannerConfig,
) -> State:
    """Begins with other problems; the counters stay as they are.

    Args:
        state: From `empty` or a search.
        where: `[P]` which rows begin anew.
        problems: `[P]`.
        status: `[P]` BUDGET_EXHAUSTED where there is something to search.
        space: Of the configurations.
        config: Planner settings.
    """
    method = method_of(config)
    control = method.begin(problems, space, config)
    found = (status == Status.BUDGET_EXHAUSTED) & jnp.any(control.solved, axis=1)
    status = jnp.where(found, Status.SOLVED, status).astype(jnp.int32)
    return state._replace(
        problems=choose(where, problems, state.problems),
        tree=plant(state.tree, method.roots(problems), where),
        control=choose(where, control, state.control),
        status=jnp.where(where, status, state.status),
        waiting=state.waiting & ~where,
    )


def advance(
    state: State,
    able: jax.Array,
    bank: Segment | None,
    config_free: ConfigFree,
    space: Space,
    config: PlannerConfig,
) -> State:
    """One round.

    Args:
        state: From `start` or an earlier round.
        able: `[P]` which problems take part.
        bank: `[P, M]` segments, M >= K, of each problem those from `state.bank_number * M` on.
            None: uniform proposals only. Bases count with `tree_context` only.
        config_free: The check of configurations.
        space: Of the configurations.
        config: Planner settings.

    Returns:
        The state; a problem that is `waiting` now needs the next `M` segments first.
    """
    method, control, problems = method_of(config), state.control, state.problems
    worker = jnp.arange(config.workers, dtype=jnp.int32)
    number = state.expansions[:, None] + worker
    box = space.box(problems.q_start[:, None], problems.q_goal[:, None])
    draw = draw_numbers(problems.key, number, box, config)
    most = None
    if method.optimises:
        draw, most = bounded.informed(draw, problems, control.side, space)
        most = jnp.where(control.connecting, jnp.inf, most)
    running = able[:, None] & (number < config.max_expansions)
    running &= worker < _width(state, config)[:, None]
    if bank is None:
        asking, segment = jnp.zeros_like(running), draw.segment
        waiting = jnp.zeros_like(able)
    else:
        asking = running & method.asks(control, draw, config)
        rows = bank.length.shape[1]
        row = state.used[:, None] + jnp.cumsum(asking, axis=1) - 1
        row -= state.bank_number[:, None] * rows
        waiting = able & jnp.any(asking & (row >= rows), axis=1)
        running, asking = (x & ~waiting[:, None] for x in (running, asking))
        row = jnp.clip(row, 0, rows - 1)
        bank = bank if config.tree_context else bank._replace(base=None)
        segment = jax.tree.map(lambda leaf: at(leaf, row), bank)

    move = method.propose(control, draw, asking, segment, problems, config)
    if segment.base is not None:  # a learned segment may lead out of the limits
        target = move.proposal.target
        inside = jnp.where(move.learned[..., None], space.project(target), target)
        move = move._replace(proposal=move.proposal._replace(target=inside))
    follows = jnp.where(
        move.learned, segment.base is not None, config.greedy & move.proposal.toward
    )
    follows = jnp.where(control.connecting, control.following, follows)
    base, away = _base(state, move, most, space, config)
    known = jnp.isfinite(away)
    base = jnp.where(control.chained, control.newest, base)
    q_base = configurations(state.tree, base)
    proposal, grows = move.proposal, ~control.connecting & ~move.learned
    if config.dynamic_domain > 0:
        within = at(state.tree.domain, base)
        outside = grows & proposal.toward & (away > within)
        proposal = domain.nearer(proposal, draw, q_base, outside, within, space)
    q_new, reached = extend(q_base, proposal, space)
    length = norm(q_new - q_base)
    cost = at(state.tree.cost, base) + length
    moves = reached | (length > 1e-6)
    if method.optimises:
        moves &= known | control.chained
        moves &= bounded.admits(
            cost, q_new, reached, control, state.tree, problems, space
        )

    asked = running & moves
    free, checks = _check(
        config_free, q_base, q_new, asked, length * _finer(state), config
    )
    slot = state.tree.size[:, None] + jnp.cumsum(free, axis=1, dtype=jnp.int32) - 1
    tree = insert(state.tree, q_new, base, control.side, cost, slot, free)
    if config.dynamic_domain > 0:
        tree = domain.adapted(
            tree,
            base,
            grows & asked & ~free,
            grows & free,
            config.dynamic_domain,
            config.step_max,
        )
    outcome = Outcome(free, slot, q_base, q_new, reached, proposal.target, follows)
    after = method.advance(control, outcome, problems, tree, space, config)
    after = choose(running, after, control)
    solved = able & jnp.any(after.solved, axis=1)
    used = state.used + jnp.sum(asking, axis=1, dtype=jnp.int32)
    bank_number = state.bank_number + waiting
    if bank is not None:  # what is left of a bank is too little for a round
        used = jnp.maximum(used, bank_number * bank.length.shape[1])
    return State(
        problems=problems,
        tree=tree,
        control=after,
        status=jnp.where(solved, Status.SOLVED, state.status).astype(jnp.int32),
        waiting=state.waiting | waiting,
        bank_number=bank_number,
        used=used,
        expansions=state.expansions + jnp.sum(running, axis=1, dtype=jnp.int32),
        accepted=state.accepted + jnp.sum(free, axis=1, dtype=jnp.int32),
        checks=state.checks + checks,
        attempt=state.attempt,
    )


def _base(
    state: State,
    move: Move,
    most: jax.Array | None,
    space: Space,
    config: PlannerConfig,
) -> tuple[jax.Array, jax.Array]:
    """SelectBase, and the tie-break toward q_toggle (section 4.3); its distance to the target."""
    tree, side, target = state.tree, state.control.side, move.proposal.target
    if config.toggle_tie_break <= 0:
        return nearest(tree, side, target, space, most)
    gaps = distances(tree, side, target, space)
    anchor, least = first_min(gaps)
    q_toggle = jnp.broadcast_to(state.problems.q_toggle[:, None], target.shape)
    to_toggle = distances(tree, side, q_toggle, space)
    ties = gaps <= least[..., None] + config.toggle_tie_break
    tied, _ = first_min(jnp.where(ties, to_toggle, jnp.inf))
    return jnp.where(move.learned, tied, anchor), least


def _width(state: State, config: PlannerConfig) -> jax.Array:
    """`[P]` workers that take part: few at first, for an easy problem is soon over.

    The very first expansions are the straight motions to the goals.
    """
    goals = 1 + state.problems.goals.shape[1]
    grown = jnp.maximum(NARROW, state.expansions // WIDENING)
    width = jnp.where(state.expansions < goals, goals, grown)
    return jnp.minimum(width, config.workers)


def _finer(state: State) -> jax.Array:
    """`[P, 1]` factor on the number of checked configurations: what was refused was too coarse."""
    return jnp.exp2(jnp.minimum(state.attempt, FINEST).astype(jnp.float32))[:, None]


def _check(
    config_free: ConfigFree,
    q0: jax.Array,
    q1: jax.Array,
    asked: jax.Array,
    length: jax.Array,
    config: PlannerConfig,
) -> tuple[jax.Array, jax.Array]:
    """`[P, K]` which motions are free, and `[P]` how many configurations that took."""
    count, workers, d = q0.shape
    problem = jnp.repeat(jnp.arange(count, dtype=jnp.int32), workers)
    points = jnp.ceil(length / config.edge_resolution - 1e-3)
    points = jnp.where(asked, jnp.maximum(points, 1), 0).astype(jnp.int32)
    free, checks = motions_free(
        config_free,
        problem,
        q0.reshape(-1, d),
        q1.reshape(-1, d),
        points.reshape(-1),
        rows_for(count, config),
    )
    shape = count, workers
    return free.reshape(shape), checks.reshape(shape).sum(1, dtype=jnp.int32)


def rows_for(lanes: int, config: PlannerConfig) -> int:
    """Configurations of one call: a single search has few at a time."""
    return min(config.check_rows, max(LEAST_ROWS, lanes * config.workers))

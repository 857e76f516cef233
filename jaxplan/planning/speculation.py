"""Many moves ahead of their verdicts, and what of them stands (see `search`)."""

from types import ModuleType
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import draw_numbers
from jaxplan.planning.result import Status
from jaxplan.planning.segment import Limits, Segment, extend
from jaxplan.planning.state import Control, Outcome, State, searching
from jaxplan.planning.tree import EMPTY, Tree, at, distances, first_min, insert


class Trial(NamedTuple):
    """K speculated moves of P problems, every field `[K, P, ...]`, not all of them made.

    Node indices from N on stand for the moves of this round: N + j is what move j adds.
    """

    running: jax.Array
    """The machine made this move at all: budget, bank and problem were not at an end."""
    control: Control
    """Control before the move."""
    asking: jax.Array
    """The move uses up a learned segment."""
    anchor: jax.Array
    """The node nearest to the target."""
    base: jax.Array
    """The node that the move starts from: the anchor, or one that ties with it."""
    side: jax.Array
    q_base: jax.Array
    q_new: jax.Array
    reached: jax.Array
    possible: jax.Array
    """The move leads anywhere, so it was assumed free."""
    fork: jax.Array
    """The verdict decides what the machine does next."""


def speculate(
    method: ModuleType,
    state: State,
    bank: Segment | None,
    first: jax.Array,
    depth: jax.Array,
    limits: Limits,
    config: PlannerConfig,
) -> Trial:
    """Runs the machine `depth` <= K moves ahead, all that lead anywhere assumed free."""
    query, count = state.query, config.proposals
    problems, capacity, d = state.tree.q.shape

    def step(j, carry):
        control, tree, running, trial = carry
        slot = jnp.full((problems,), capacity, jnp.int32) + j
        draw = draw_numbers(query.key, state.expansions + j, limits, config)
        running &= ~control.solved & (state.expansions + j < config.max_expansions)
        if bank is None:
            asking, segment = jnp.zeros((problems,), bool), draw.segment
        else:
            asking = method.asks(control, draw, config)
            row, last = control.used - first, bank.length.shape[1] - 1
            running &= ~(asking & (row > last))
            row = jnp.clip(row, 0, last)
            segment = Segment(at(bank.direction, row), at(bank.length, row))

        move = method.propose(control, tree, draw, asking, segment, query, config)
        anchor, base = _base(tree, control, move, query, config)
        newest = jnp.where(j == 0, state.tree.size - 1, slot - 1)
        base = jnp.where(control.chained, newest, base)
        anchor = jnp.where(control.chained, newest, anchor)
        q_base = at(tree.q, base)
        q_new, reached = extend(q_base, move.proposal, limits)
        possible = reached | (jnp.linalg.norm(q_new - q_base, axis=-1) > 1e-6)

        outcome = Outcome(possible, slot, q_base, q_new, reached)
        after = method.advance(control, outcome, query, config)
        rejected = outcome._replace(accepted=jnp.zeros_like(possible))
        otherwise = method.advance(control, rejected, query, config)
        this = Trial(
            running=running,
            control=control,
            asking=asking,
            anchor=anchor,
            base=base,
            side=control.side,
            q_base=q_base,
            q_new=q_new,
            reached=reached,
            possible=possible,
            fork=_differ(after, otherwise),
        )
        side = jnp.where(running & possible, control.side, EMPTY)
        tree = tree._replace(
            q=tree.q.at[:, capacity + j].set(q_new),
            side=tree.side.at[:, capacity + j].set(side),
        )
        after = after._replace(used=control.used + asking)
        trial = jax.tree.map(lambda moves, move: moves.at[j].set(move), trial, this)
        return after, tree, running, trial

    wide = Tree(
        q=jnp.pad(state.tree.q, ((0, 0), (0, count), (0, 0))),
        parent=state.tree.parent,
        side=jnp.pad(state.tree.side, ((0, 0), (0, count)), constant_values=EMPTY),
        size=state.tree.size,
    )
    no = jnp.zeros((count, problems), bool)
    zero, q = jnp.zeros_like(no, jnp.int32), jnp.zeros((count, problems, d))
    control = Control(
        side=zero, connecting=no, chained=no, aim=zero, used=zero, solved=no
    )
    blank = Trial(no, control, no, zero, zero, zero, q, q, no, no, no)
    ready = searching(state, config) & ~state.waiting
    carry = (state.control, wide, ready, blank)
    return jax.lax.fori_loop(0, depth, step, carry)[-1]


def _base(tree, control, move, query, config):
    """`(anchor, base)`: SelectBase, and the tie-break toward q_toggle (section 4.3)."""
    gaps = distances(tree, control.side, move.proposal.target, config.metric)
    anchor = first_min(gaps)
    if config.toggle_tie_break <= 0:
        return anchor, anchor
    ties = gaps <= at(gaps, anchor)[:, None] + config.toggle_tie_break
    to_toggle = distances(tree, control.side, query.q_toggle, config.metric)
    tied = first_min(jnp.where(ties, to_toggle, jnp.inf))
    return anchor, jnp.where(move.learned, tied, anchor)


def _differ(a: Control, b: Control) -> jax.Array:
    """`[P]` whether two controls differ in anything."""
    fields = jax.tree.leaves(jax.tree.map(jnp.not_equal, a, b))
    return jnp.any(jnp.stack(fields), axis=0)


def settle(
    method: ModuleType,
    state: State,
    trial: Trial,
    free: jax.Array,
    config: PlannerConfig,
) -> State:
    """Commits the moves that the machine would have made, with their verdicts."""
    capacity, count = state.tree.q.shape[1], free.shape[0]
    ok = free & trial.possible

    def of_move(values, index):  # [K, P] at the moves that node indices stand for
        move = jnp.clip(index - capacity, 0, count - 1)
        return jnp.take_along_axis(values, move, axis=0)

    def stands(index):
        return (index < capacity) | of_move(ok, index)

    follows = (ok == trial.possible) | ~trial.fork
    follows = jnp.concatenate([jnp.ones_like(follows[:1]), follows[:-1]])
    commit = trial.running & stands(trial.anchor) & stands(trial.base) & follows
    commit = jnp.cumprod(commit, axis=0, dtype=jnp.int32).astype(bool)
    keep = commit & ok
    number = state.tree.size + jnp.cumsum(keep, axis=0, dtype=jnp.int32) - 1

    def renumber(index):
        return jnp.where(index < capacity, index, of_move(number, index))

    tree = insert(state.tree, trial.q_new, renumber(trial.base), trial.side, keep)
    moves = jnp.sum(commit, axis=0, dtype=jnp.int32)

    # the last committed move, with its verdict, gives the control to go on from
    last, lane = jnp.maximum(moves - 1, 0), jnp.arange(moves.size)
    before = jax.tree.map(lambda x: x[last, lane], trial.control)
    outcome = Outcome(
        accepted=ok[last, lane],
        slot=capacity + last,
        q_base=trial.q_base[last, lane],
        q_new=trial.q_new[last, lane],
        reached=trial.reached[last, lane],
    )
    after = method.advance(before, outcome, state.query, config)
    after = after._replace(used=before.used + trial.asking[last, lane])
    after = after._replace(aim=renumber(after.aim[None])[0])
    went = moves > 0
    control = jax.tree.map(lambda a, b: jnp.where(went, a, b), after, state.control)

    # the first move of a problem that can move is always committed, so `went` tells who
    # waits; a search that is over keeps its status, one under way may be solved now
    solved = went & control.solved
    step = jnp.arange(count, dtype=jnp.int32)[:, None]
    at_flag = jnp.where(commit, state.expansions + step, config.max_expansions)
    return State(
        query=state.query,
        tree=tree,
        control=control,
        status=jnp.where(solved, Status.SOLVED, state.status).astype(jnp.int32),
        waiting=~went,
        expansions=state.expansions + moves,
        accepted=state.accepted + jnp.sum(keep, axis=0, dtype=jnp.int32),
        checked=state.checked + jnp.sum(trial.running, axis=0, dtype=jnp.int32),
        flags=state.flags.at[lane, at_flag].set(ok, mode="drop"),
    )

"""Many moves ahead of their verdicts, and what of them stands (see `search`)."""

from types import ModuleType
from typing import NamedTuple

import jax
import jax.numpy as jnp

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import Draw
from jaxplan.planning.result import Status
from jaxplan.planning.segment import Segment, extend
from jaxplan.planning.state import Control, Limits, Outcome, State, searching
from jaxplan.planning.tree import EMPTY, Tree, at, distances, insert


class Trial(NamedTuple):
    """K speculated moves of P problems, every field `[K, P, ...]`.

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
    draws: Draw,
    limits: Limits,
    config: PlannerConfig,
) -> Trial:
    """Runs the machine K moves ahead, every motion that leads anywhere assumed free."""
    query = state.query
    problems, capacity, _ = state.tree.q.shape
    count = config.proposals

    def step(carry, move_and_draw):
        control, tree, running = carry
        j, draw = move_and_draw
        slot = jnp.full((problems,), capacity, jnp.int32) + j
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
        q_new, reached = extend(q_base, move.proposal, *limits)
        possible = reached | (jnp.linalg.norm(q_new - q_base, axis=-1) > 1e-6)

        outcome = Outcome(possible, slot, q_base, q_new, reached)
        after = method.advance(control, outcome, query, config)
        rejected = outcome._replace(accepted=jnp.zeros_like(possible))
        otherwise = method.advance(control, rejected, query, config)
        trial = Trial(
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
        return (after, tree, running), trial

    wide = Tree(
        q=jnp.pad(state.tree.q, ((0, 0), (0, count), (0, 0))),
        parent=state.tree.parent,
        side=jnp.pad(state.tree.side, ((0, 0), (0, count)), constant_values=EMPTY),
        size=state.tree.size,
    )
    moves = jnp.arange(count, dtype=jnp.int32)
    carry = (state.control, wide, searching(state, config))
    _, trial = jax.lax.scan(step, carry, (moves, draws))
    return trial


def _base(tree, control, move, query, config):
    """`(anchor, base)`: SelectBase, and the tie-break toward q_toggle (section 4.3)."""
    gaps = distances(tree, control.side, move.proposal.target, config.metric)
    anchor = jnp.argmin(gaps, axis=-1).astype(jnp.int32)
    if config.toggle_tie_break <= 0:
        return anchor, anchor
    ties = gaps <= at(gaps, anchor)[:, None] + config.toggle_tie_break
    to_toggle = distances(tree, control.side, query.q_toggle, config.metric)
    tied = jnp.argmin(jnp.where(ties, to_toggle, jnp.inf), axis=-1).astype(jnp.int32)
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

    # a search that is over keeps its status; one under way may be solved now
    solved = went & control.solved
    step = jnp.arange(count, dtype=jnp.int32)[:, None]
    at_flag = jnp.where(commit, state.expansions + step, config.max_expansions)
    return State(
        query=state.query,
        tree=tree,
        control=control,
        status=jnp.where(solved, Status.SOLVED, state.status).astype(jnp.int32),
        expansions=state.expansions + moves,
        accepted=state.accepted + jnp.sum(keep, axis=0, dtype=jnp.int32),
        checked=state.checked + jnp.sum(trial.running, axis=0, dtype=jnp.int32),
        flags=state.flags.at[lane, at_flag].set(ok, mode="drop"),
    )

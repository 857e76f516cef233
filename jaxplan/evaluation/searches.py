"""One planner's searches on recorded problems, with a sampler or without.

Problems are searched many at a time; each answer is that of the problem alone, since
nothing about a problem depends on its neighbours (`planning.search`).
"""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan.config import PlannerConfig
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.learning import Weights
from jaxplan.learning.predictor import encodings
from jaxplan.motion.search import sampled_search
from jaxplan.networks import Cond
from jaxplan.planning import DrawBank, Segment, Status
from jaxplan.robots import JointLimits
from jaxplan.samplers import Bank
from jaxplan.scene import Scene

LANES = 256
"""Problems side by side."""
BLOCK = 64
"""Problems whose segments are drawn in one call."""


class Answers(NamedTuple):
    """Of P problems, as in `PlanResult`."""

    status: np.ndarray
    expansions: np.ndarray
    accepted: np.ndarray
    learned: np.ndarray
    checks: np.ndarray

    @property
    def solved(self) -> np.ndarray:
        """bool [P]."""
        return self.status == Status.SOLVED


def conditions(problems: RecordedProblems, predictor: Weights) -> Cond:
    """What the samplers are told of each problem; features are the predictor's, frozen."""
    features, _ = encodings(predictor.config, predictor.params, problems.image)
    columns: dict[str, Any] = {
        "image": features,
        "q": problems.q,
        "gripper": problems.gripper,
        "q_toggle": problems.q_toggle,
        "gripper_toggle": problems.gripper_toggle,
        "q_goal": problems.target,
    }
    return Cond(**columns)


class KeptBanks:
    """Learned segments of P problems, drawn once, however many searches ask for them.

    They are those that Algorithm 1 would draw.

    Args:
        bank: Of segments.
        cond: Of the problems.
        keys: [P] typed, of the problems.
    """

    def __init__(self, bank: Bank, cond: Cond, keys: jax.Array) -> None:
        self._bank, self._cond, self._keys = bank, cond, keys
        self._banks: dict[int, tuple[np.ndarray, Any]] = {}

    def of(self, rows: np.ndarray) -> DrawBank:
        """The planner's `draw` for some of the problems."""

        def draw(bank_number: jax.Array) -> Segment:
            numbers = np.maximum(np.asarray(bank_number), 0)
            bank = self._empty(len(rows))
            for number in np.unique(numbers):
                where = np.flatnonzero(numbers == number)
                _put(bank, where, self._get(int(number), rows[where]))
            return jax.tree.map(jnp.asarray, bank)

        return draw

    def _empty(self, count: int) -> Any:
        """Room for a bank of `count` problems, a Segment of NumPy arrays."""
        shape = count, self._bank.size, self._cond.q.shape[1]
        zeros: list[Any] = [np.zeros(n, np.float32) for n in (shape, shape[:2], shape)]
        return Segment(*zeros[: 3 if self._bank.config.tree_context else 2])

    def _get(self, number: int, rows: np.ndarray) -> Any:
        """The segments of a bank; those that nobody asked for yet are drawn."""
        if number not in self._banks:
            count = len(self._cond.q)
            self._banks[number] = np.zeros(count, bool), self._empty(count)
        there, bank = self._banks[number]
        missing = np.unique(rows[~there[rows]])
        for first in range(0, len(missing), BLOCK):
            part = missing[first : first + BLOCK]
            # A block that is not full repeats its last row: one shape, one program.
            block = np.pad(part, (0, BLOCK - len(part)), mode="edge")
            cond = jax.tree.map(
                lambda leaf, at=block: jnp.asarray(leaf[at]), self._cond
            )
            draw = self._bank.of(cond, self._keys[block])
            drawn = draw(jnp.full(BLOCK, number, jnp.int32))
            _put(bank, part, drawn)
            there[part] = True
        return jax.tree.map(lambda leaf: leaf[rows], bank)


def _put(bank: Any, rows: np.ndarray, drawn: Any) -> None:
    """Writes into the bank's NumPy arrays; what was drawn beyond the rows is padding."""
    for into, leaf in zip(jax.tree.leaves(bank), jax.tree.leaves(drawn), strict=True):
        into[rows] = np.asarray(leaf)[: len(rows)]


class Searcher:
    """A planner for recorded problems, compiled once.

    Args:
        scene: What collides.
        config: Settings of the search.
        limits: Of the joints.
    """

    def __init__(
        self, scene: Scene, config: PlannerConfig, limits: JointLimits
    ) -> None:
        config = dataclasses.replace(config, lanes=LANES)
        self._plan = sampled_search(scene, config, limits)()

    def __call__(
        self,
        problems: RecordedProblems,
        rows: np.ndarray,
        banks: KeptBanks | None = None,
    ) -> Answers:
        """Searches some of the problems, those alike beside each other.

        Args:
            problems: P problems.
            rows: Which of them.
            banks: Learned segments of the P problems; None = uniform proposals only.

        Returns:
            In the order of `rows`.
        """
        keys, worlds = problems.keys(), problems.worlds
        gap = np.linalg.norm(problems.q_goal - problems.q_start, axis=1)[rows]
        order = np.lexsort((gap, problems.blocked[rows]))
        answers = np.zeros((len(Answers._fields), len(rows)), np.int32)
        for first in range(0, len(order), LANES):
            part = order[first : first + LANES]
            lanes = np.pad(rows[part], (0, LANES - len(part)), mode="edge")
            result = self._plan(
                jax.tree.map(lambda leaf, at=lanes: jnp.asarray(leaf[at]), worlds),
                problems.q_start[lanes],
                problems.q_goal[lanes],
                problems.q_toggle[lanes],
                keys[lanes],
                None if banks is None else banks.of(lanes),
                np.arange(LANES) < len(part),
            )
            for row, name in enumerate(Answers._fields):
                answers[row, part] = np.asarray(getattr(result, name))[: len(part)]
        return Answers(*answers)

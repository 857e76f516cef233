"""One planner's searches on recorded problems, with a sampler or without.

Problems are searched many at a time; each answer is that of the problem alone, since
nothing about a problem depends on its neighbours (`planning.search`).
"""

import dataclasses
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import collision, samplers
from jaxplan.agent import BANK
from jaxplan.config import PlannerConfig
from jaxplan.evaluation.problems import Problems
from jaxplan.learning import Weights
from jaxplan.learning.predictor import image_features
from jaxplan.motion import jit
from jaxplan.networks import Cond
from jaxplan.planning import Segment, Status, make_planner
from jaxplan.scene import Scene
from jaxplan.scene.panda import PANDA_LIMITS

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


def conditions(problems: Problems, predictor: Weights) -> Cond:
    """What the samplers are told of each problem; features are the predictor's, frozen."""
    features = image_features(predictor.config, predictor.params, problems.image)
    columns: dict[str, Any] = {
        "image": features,
        "q": problems.q,
        "gripper": problems.gripper,
        "q_toggle": problems.q_toggle,
        "gripper_toggle": problems.gripper_toggle,
        "q_goal": problems.target,
    }
    return Cond(**columns)


class Banks:
    """Learned segments of P problems, drawn once, however many searches ask for them.

    They are those that the outer loop's `Agent` would draw.

    Args:
        sampler: Its weights.
        cond: Of the problems.
        keys: [P] typed, of the problems.
        changes: To the sampler's config, such as `num_inference_steps`.
    """

    def __init__(
        self, sampler: Weights, cond: Cond, keys: jax.Array, **changes: Any
    ) -> None:
        config = dataclasses.replace(sampler.config, **changes)
        self._cond, self._keys = cond, keys
        self._tree_context = config.tree_context
        self._chunks: dict[int, tuple[np.ndarray, Any]] = {}

        @jit
        def draw(cond, keys, chunk):
            params = sampler.params
            return samplers.draw_chunk(config, params, cond, keys, chunk, BANK)

        self._draw = draw

    def of(self, rows: np.ndarray) -> Callable[[jax.Array], Segment]:
        """The planner's `draw` for some of the problems."""

        def draw(chunk: jax.Array) -> Segment:
            chunks = np.maximum(np.asarray(chunk), 0)
            bank = self._empty(len(rows))
            for number in np.unique(chunks):
                where = np.flatnonzero(chunks == number)
                _put(bank, where, self._get(int(number), rows[where]))
            return jax.tree.map(jnp.asarray, bank)

        return draw

    def _empty(self, count: int) -> Any:
        """Room for a bank of `count` problems, a Segment of NumPy arrays."""
        shape = count, BANK, self._cond.q.shape[1]
        zeros: list[Any] = [np.zeros(n, np.float32) for n in (shape, shape[:2], shape)]
        return Segment(*zeros[: 3 if self._tree_context else 2])

    def _get(self, chunk: int, rows: np.ndarray) -> Any:
        """The segments of a chunk; those that nobody asked for yet are drawn."""
        if chunk not in self._chunks:
            count = len(self._cond.q)
            self._chunks[chunk] = np.zeros(count, bool), self._empty(count)
        there, bank = self._chunks[chunk]
        missing = np.unique(rows[~there[rows]])
        for first in range(0, len(missing), BLOCK):
            part = missing[first : first + BLOCK]
            # A block that is not full repeats its last row: one shape, one program.
            block = np.pad(part, (0, BLOCK - len(part)), mode="edge")
            cond = jax.tree.map(
                lambda leaf, at=block: jnp.asarray(leaf[at]), self._cond
            )
            number = jnp.full(BLOCK, chunk, jnp.int32)
            drawn = self._draw(cond, self._keys[block], number)
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
    """

    def __init__(self, scene: Scene, config: PlannerConfig) -> None:
        def config_free(worlds, problem, q):
            world = jax.tree.map(lambda leaf: leaf[problem], worlds)
            return collision.config_free(scene, world, q, config.margin)

        config = dataclasses.replace(config, lanes=LANES)
        limits = PANDA_LIMITS.q_min, PANDA_LIMITS.q_max
        self._plan = make_planner(config_free, config, *limits, jit)

    def __call__(
        self, problems: Problems, rows: np.ndarray, banks: Banks | None = None
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

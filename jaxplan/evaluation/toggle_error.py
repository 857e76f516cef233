"""How far predicted toggles are from the expert's, at the phase starts that execution met."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxplan.base import Phase
from jaxplan.data import TOGGLES
from jaxplan.tasks import Tabletop


class ToggleError(NamedTuple):
    """One prediction's L2 errors over the joints [rad]."""

    toggle: int
    """Index into `TOGGLES` of the toggle that came next."""
    error: float
    """To the expert's."""
    nearest: float
    """To the nearest toggle of the whole episode: the paper's measure."""


class _Prediction(NamedTuple):
    episode: int
    toggle: int
    predicted: np.ndarray
    expert: np.ndarray


class ToggleErrors:
    """Listens to Algorithm 1 and compares each prediction with the expert's toggle.

    The expert sees everything; it is asked after the prediction was made and answers nobody else.
    """

    def __init__(self, task: Tabletop) -> None:
        self._task = task
        self._predictions: list[_Prediction] = []

    def __call__(self, phase: Phase) -> None:
        """Keeps a round's predictions."""
        task, decision = self._task, phase.action.decision
        for e in phase.lanes:
            dropped = task.closed[e] and not task.held(e)
            if e in decision.backing or task.in_terminal_region(e) or dropped:
                continue
            keyframes = task.keyframes(e, phase.observation.q[e])
            predicted = decision.subgoal.q_toggle[e]
            self._predictions.append(
                _Prediction(e, keyframes.toggle, predicted, keyframes.q[-1])
            )

    def finish(self) -> list[ToggleError]:
        """Ends a batch, whose episodes' toggles are now all known; its errors."""
        truth: dict[int, list[np.ndarray]] = {}
        for p in self._predictions:
            truth.setdefault(p.episode, []).append(p.expert)
        errors = []
        for p in self._predictions:
            error = np.linalg.norm(p.predicted - p.expert)
            distances = np.linalg.norm(np.array(truth[p.episode]) - p.predicted, axis=1)
            errors.append(ToggleError(p.toggle, float(error), float(distances.min())))
        self._predictions = []
        return errors


def summarize(errors: Sequence[ToggleError]) -> dict[str, Any]:
    """Mean and median of each toggle and of all, and the nearest-toggle mean [rad].

    Empty if there are no errors.
    """
    if not errors:
        return {}
    per_toggle = {}
    for index, name in enumerate(TOGGLES):
        if own := [row.error for row in errors if row.toggle == index]:
            per_toggle[name] = {**_statistics(own), "phases": len(own)}
    return {
        "per_toggle": per_toggle,
        **_statistics([row.error for row in errors]),
        "nearest_toggle_mean": float(np.mean([row.nearest for row in errors])),
    }


def _statistics(values: Sequence[float]) -> dict[str, float]:
    return {"mean": float(np.mean(values)), "median": float(np.median(values))}

"""How far predicted toggles are from the expert's, at the phase starts that execution met."""

from typing import NamedTuple

import numpy as np

from jaxplan.data import TOGGLES
from jaxplan.rollout import Phase
from jaxplan.tasks.mug.expert import Expert
from jaxplan.tasks.mug.task import MugTask


class ToggleErrors:
    """Listens to the outer loop and compares each prediction with the expert's toggle.

    The expert sees the mug; it is asked after the prediction was made and answers nobody else.
    """

    class Row(NamedTuple):
        """One prediction."""

        episode: int
        toggle: int
        predicted: np.ndarray
        expert: np.ndarray

    def __init__(self, task: MugTask) -> None:
        self._task, self._expert = task, Expert(task.model, task.shape)
        self._rows: list[ToggleErrors.Row] = []
        self._done: list[dict] = []

    def __call__(self, phase: Phase) -> None:
        """Keeps the errors of a round."""
        for row, e in enumerate(phase.episodes):
            if self._task.in_terminal_region(e):
                continue
            q = phase.observation.q[row].astype(float)
            keyframes = self._expert.keyframes(
                self._task.mug(e), q, bool(self._task.closed[e])
            )
            self._rows.append(
                self.Row(
                    e,
                    int(keyframes.toggle),
                    phase.targets.q_toggle[row],
                    keyframes.q[-1],
                )
            )

    def finish(self) -> None:
        """Ends a batch: its episodes' toggles are now all known."""
        truth: dict[int, list[np.ndarray]] = {}
        for row in self._rows:
            truth.setdefault(row.episode, []).append(row.expert)
        for row in self._rows:
            nearest = np.linalg.norm(
                np.array(truth[row.episode]) - row.predicted, axis=1
            ).min()
            error = np.linalg.norm(row.predicted - row.expert)
            self._done.append(
                {
                    "toggle": TOGGLES[row.toggle],
                    "error": float(error),
                    "nearest": float(nearest),
                }
            )
        self._rows = []

    def summary(self) -> dict:
        """L2 errors over the joints [rad]: mean and median per toggle, and the paper's nearest-toggle mean."""
        if not self._done:
            return {}
        table = {}
        for toggle in TOGGLES:
            errors = [row["error"] for row in self._done if row["toggle"] == toggle]
            if errors:
                table[toggle] = {
                    "mean": float(np.mean(errors)),
                    "median": float(np.median(errors)),
                    "phases": len(errors),
                }
        errors = [row["error"] for row in self._done]
        return {
            "per_toggle": table,
            "mean": float(np.mean(errors)),
            "median": float(np.median(errors)),
            "nearest_toggle_mean": float(
                np.mean([row["nearest"] for row in self._done])
            ),
        }

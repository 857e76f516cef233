"""Expansion counts of two methods on the same problems, set in relation."""

from typing import NamedTuple

import numpy as np

from jaxplan.evaluation.statistics import ratio_of_means, wilson
from jaxplan.evaluation.tables import Estimate


class Counts(NamedTuple):
    """One method on P problems."""

    expansions: np.ndarray
    """[P], N_rrt where the search failed."""
    solved: np.ndarray
    """[P] bool."""
    trial: np.ndarray
    """[P] which episode the problem belongs to."""


def solved_share(counts: Counts, rows: np.ndarray) -> Estimate:
    """Solved problems among `rows` [P] bool, in percent, with Wilson's interval."""
    solved, total = int(counts.solved[rows].sum()), int(rows.sum())
    if total == 0:
        return Estimate(*[float("nan")] * 3)
    low, high = wilson(solved, total)
    return Estimate(100 * solved / total, 100 * low, 100 * high)


def normalised(
    counts: Counts,
    ours: Counts,
    rows: np.ndarray,
    own_rows: np.ndarray | None = None,
    whole_trials: bool = False,
) -> Estimate:
    """Mean expansions of a method over ours, with a bootstrap interval over trials.

    Args:
        counts: The method.
        ours: What it is normalised to.
        rows: [P] bool, the problems that count.
        own_rows: The same for ours, where it differs.
        whole_trials: Sums over a trial's problems, over the trials all of whose problems
            the method solves, as in the paper.
    """
    own_rows = rows if own_rows is None else own_rows
    if whole_trials:
        sides = [_trials(c, r) for c, r in ((counts, rows), (ours, own_rows))]
    else:
        sides = [(c.expansions * r, r) for c, r in ((counts, rows), (ours, own_rows))]
    groups = np.arange(len(sides[0][0])) if whole_trials else counts.trial
    return Estimate(*ratio_of_means(*sides[0], *sides[1], groups))


def _trials(counts: Counts, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Per trial: expansions on `rows`, and 1 where there are any and all are solved."""
    size = counts.trial.max() + 1
    total = np.bincount(counts.trial, counts.expansions * rows, size)
    failed = np.bincount(counts.trial, rows & ~counts.solved, size) > 0
    there = np.bincount(counts.trial, rows, size) > 0
    good = there & ~failed
    return total * good, good

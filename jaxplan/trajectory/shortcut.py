"""Shortcuts: replace a stretch of the path by a straight line that is free."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import numpy as np

from jaxplan.config import TrajectoryConfig
from jaxplan.trajectory.spline import arc_length, at_arc_length, fit_polyline
from jaxplan.trajectory.validation import Validation

_SMALLEST_SAVING = 1e-3  # [rad]; less is not worth a check
_INNER = np.arange(1, 16)[:, None] / 16.0  # where all candidates are asked


def shortcut(
    paths: Sequence[np.ndarray],
    keys: jax.Array,
    validation: Validation,
    config: TrajectoryConfig,
    circular: np.ndarray | None = None,
) -> list[np.ndarray]:
    """Shortens paths by free straight lines (section 4.3).

    In each of `config.shortcut_rounds` rounds every path draws
    `config.shortcut_candidates` pairs of points, uniform over its arc length, and takes
    the free line that saves most. The very first candidate is the whole path. Drawing
    depends on the path's key alone: neighbours in the batch change nothing.

    On a circular joint a line goes the short way round, and what follows it is shifted
    by the same full turns: q is then an angle that may leave [-pi, pi], and the path
    ends at q_goal but for full turns.

    To keep checks few, all candidates are asked at a few inner points first; those that
    are left are asked in full from the largest saving down, until one is free.

    Args:
        paths: P arrays `[W_p, d]` of waypoints [rad].
        keys: `[P]` typed keys, one a path.
        validation: what is free.
        config: rounds and candidates.
        circular: `Bool[d]` joints that live on a circle; None = none.

    Returns:
        P arrays `[W'_p, d]` with the same ends, none longer than it was.
    """
    paths = list(paths)
    period = np.where(np.zeros(1) if circular is None else circular, 2.0 * np.pi, 0.0)
    if all(len(path) <= 2 for path in paths):
        return paths
    # Drawn on the host: a jitted draw would be compiled for every number of paths.
    sources = [
        np.random.default_rng(seed) for seed in np.array(jax.random.key_data(keys))
    ]
    for round_ in range(config.shortcut_rounds):
        shares = [rng.random((config.shortcut_candidates, 2)) for rng in sources]
        if round_ == 0:
            for pairs in shares:
                pairs[0] = (0.0, 1.0)
        lines = {
            p: _candidates(path, shares[p], period)
            for p, path in enumerate(paths)
            if len(path) > 2
        }
        for p, line in _longest_free(lines, validation).items():
            paths[p] = _splice(paths[p], line)
    return paths


class _Line(NamedTuple):
    """A stretch of the arc length, the line over it, and the turns of what follows."""

    s_0: float
    s_1: float
    a: np.ndarray
    b: np.ndarray
    turns: np.ndarray


def _candidates(
    path: np.ndarray, shares: np.ndarray, period: np.ndarray
) -> list[_Line]:
    """Candidate lines from `shares` `[C, 2]` of the length, by falling saving."""
    s = np.sort(shares, axis=1) * arc_length(path)[-1]
    a, b = at_arc_length(path, s[:, 0]), at_arc_length(path, s[:, 1])
    turns = period * np.round((a - b) / np.where(period > 0.0, period, 1.0))
    b = b + turns
    saving = s[:, 1] - s[:, 0] - np.linalg.norm(b - a, axis=1)
    order = np.argsort(-saving, kind="stable")
    return [
        _Line(s[i, 0], s[i, 1], a[i], b[i], turns[i])
        for i in order
        if saving[i] > _SMALLEST_SAVING
    ]


def _longest_free(
    lines: dict[int, list[_Line]], validation: Validation
) -> dict[int, _Line]:
    """The first free line of each problem's list, for problems that have one."""
    problem = [p for p, candidates in lines.items() for _ in candidates]
    flat = [line for candidates in lines.values() for line in candidates]
    inner = [line.a + _INNER * (line.b - line.a) for line in flat]
    hopeful = validation.points_free(problem, inner)
    waiting: dict[int, list[_Line]] = {}
    for p, line, hope in zip(problem, flat, hopeful, strict=True):
        if hope:
            waiting.setdefault(p, []).append(line)
    taken = {}
    while waiting:
        first = {p: candidates.pop(0) for p, candidates in waiting.items()}
        curves = [fit_polyline(np.stack([line.a, line.b])) for line in first.values()]
        free = validation.curves_free(list(first), curves)
        taken |= {p: first[p] for p, ok in zip(first, free, strict=True) if ok}
        waiting = {p: rest for p, rest in waiting.items() if rest and p not in taken}
    return taken


def _splice(path: np.ndarray, line: _Line) -> np.ndarray:
    """`path` with the stretch between arc lengths s_0 and s_1 replaced by a line."""
    along, turned = arc_length(path), path + line.turns
    before, after = path[along < line.s_0], turned[along > line.s_1]
    head = [path[0]] if line.s_0 == 0.0 else [*before, line.a]
    tail = [turned[-1]] if line.s_1 == along[-1] else [line.b, *after]
    return np.stack([*head, *tail])

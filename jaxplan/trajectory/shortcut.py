"""Shortcuts: replace a stretch of the path by a straight line that is free."""

from collections.abc import Sequence

import jax
import numpy as np

from jaxplan.config import TrajectoryConfig
from jaxplan.trajectory.spline import arc_length, at_arc_length
from jaxplan.trajectory.validation import ConfigFree, line_points, points_free

_SMALLEST_SAVING = 1e-3  # [rad]; less is not worth a check
_QUARTERS = np.array([0.25, 0.5, 0.75])[:, None]


def shortcut(
    paths: Sequence[np.ndarray],
    keys: jax.Array,
    config_free: ConfigFree,
    config: TrajectoryConfig,
) -> list[np.ndarray]:
    """Shortens paths by free straight lines (section 4.3).

    In each of `config.shortcut_rounds` rounds every path draws
    `config.shortcut_candidates` pairs of points, uniform over its arc length, and takes
    the free line that saves most. The very first candidate is the whole path. Drawing
    depends on the path's key alone: neighbours in the batch change nothing.

    To keep checks few, all candidates are asked at three inner points first; the rest
    are asked in full from the largest saving down, until one is free.

    Args:
        paths: P arrays `[W_p, d]` of waypoints [rad].
        keys: `[P]` typed keys, one a path.
        config_free: `(problem, q) -> Bool`, see `points_free`.
        config: rounds, candidates and the check's resolution.

    Returns:
        P arrays `[W'_p, d]` with the same ends, none longer than it was.
    """
    paths = list(paths)
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
            p: _candidates(path, shares[p])
            for p, path in enumerate(paths)
            if len(path) > 2
        }
        for p, line in _longest_free(lines, config_free, config).items():
            paths[p] = _splice(paths[p], *line)
    return paths


_Line = tuple[float, float, np.ndarray, np.ndarray]
"""A stretch (s_0, s_1) of the arc length and the path's points at its ends."""


def _candidates(path: np.ndarray, shares: np.ndarray) -> list[_Line]:
    """Candidate lines from `shares` `[C, 2]` of the length, by falling saving."""
    s = np.sort(shares, axis=1) * arc_length(path)[-1]
    a, b = at_arc_length(path, s[:, 0]), at_arc_length(path, s[:, 1])
    saving = s[:, 1] - s[:, 0] - np.linalg.norm(b - a, axis=1)
    order = np.argsort(-saving, kind="stable")
    return [
        (s[i, 0], s[i, 1], a[i], b[i]) for i in order if saving[i] > _SMALLEST_SAVING
    ]


def _longest_free(
    lines: dict[int, list[_Line]], config_free: ConfigFree, config: TrajectoryConfig
) -> dict[int, _Line]:
    """The first free line of each problem's list, for problems that have one."""
    problem = [p for p, candidates in lines.items() for _ in candidates]
    flat = [line for candidates in lines.values() for line in candidates]
    inner = [a + _QUARTERS * (b - a) for _, _, a, b in flat]
    hopeful = points_free(config_free, problem, inner, config.check_rows)
    waiting: dict[int, list[_Line]] = {}
    for p, line, hope in zip(problem, flat, hopeful, strict=True):
        if hope:
            waiting.setdefault(p, []).append(line)
    taken = {}
    while waiting:
        first = {p: candidates.pop(0) for p, candidates in waiting.items()}
        points = [
            line_points(a, b, config.check_resolution)[int(s_0 == 0.0) :]
            for s_0, _, a, b in first.values()
        ]
        free = points_free(config_free, list(first), points, config.check_rows)
        taken |= {p: first[p] for p, ok in zip(first, free, strict=True) if ok}
        waiting = {p: rest for p, rest in waiting.items() if rest and p not in taken}
    return taken


def _splice(
    path: np.ndarray, s_0: float, s_1: float, a: np.ndarray, b: np.ndarray
) -> np.ndarray:
    """`path` with the stretch between arc lengths s_0 and s_1 replaced by a line."""
    along = arc_length(path)
    before, after = path[along < s_0], path[along > s_1]
    head = [path[0]] if s_0 == 0.0 else [*before, a]
    tail = [path[-1]] if s_1 == along[-1] else [b, *after]
    return np.stack([*head, *tail])

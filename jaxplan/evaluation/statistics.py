"""Intervals for what was counted or measured."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import binomtest


def wilson(successes: int, trials: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's score interval of a success rate (95 % by default).

    Raises:
        ValueError: No trials.
    """
    if trials < 1:
        raise ValueError("an interval needs at least one trial")
    rate = successes / trials
    middle = rate + z * z / (2 * trials)
    spread = z * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    low, high = (middle - spread) / scale, (middle + spread) / scale
    # Of none and of all a bound is exact, but for rounding.
    return (low if successes else 0.0), (high if successes < trials else 1.0)


def bootstrap(
    statistic: Callable[[np.ndarray], np.ndarray],
    groups: np.ndarray,
    resamples: int = 2000,
    level: float = 0.95,
) -> tuple[float, float]:
    """Percentile interval of a statistic when whole groups are drawn again, with return.

    Args:
        statistic: Weights [R, N] of N observations to values [R]; not finite = undefined.
        groups: [N] which group each observation belongs to, such as the episode.
        resamples: R, drawn from a fixed seed.
        level: Of confidence.

    Returns:
        Lower and upper end; NaN if the statistic is undefined in most resamples.
    """
    names, group = np.unique(groups, return_inverse=True)
    rng = np.random.default_rng(0)
    counts = rng.multinomial(len(names), np.full(len(names), 1 / len(names)), resamples)
    values = np.asarray(statistic(counts[:, group]))
    values = values[np.isfinite(values)]
    if len(values) < resamples / 2:
        return math.nan, math.nan
    low, high = np.quantile(values, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def ratio_of_means(
    total: np.ndarray,
    count: np.ndarray,
    own_total: np.ndarray,
    own_count: np.ndarray,
    groups: np.ndarray,
) -> tuple[float, float, float]:
    """sum(total) / sum(count) over the same of another side, with its bootstrap interval.

    Args:
        total: [N] sums, 0 where they do not count.
        count: [N] how many observations each sum is of.
        own_total: Of the side that the ratio is to.
        own_count: Likewise.
        groups: [N] as for `bootstrap`.

    Returns:
        The ratio, lower and upper end.
    """

    def ratio(weights: np.ndarray) -> np.ndarray:
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = (weights @ total) / (weights @ count.astype(float))
            own = (weights @ own_total) / (weights @ own_count.astype(float))
            return mean / own

    value = float(ratio(np.ones((1, len(total))))[0])
    return value, *bootstrap(ratio, groups)


def mcnemar(first: Sequence[bool], second: Sequence[bool]) -> dict[str, float]:
    """McNemar's exact test of two agents in the same episodes, two-sided.

    Returns:
        In how many only the first succeeded (`only_first`), in how many only the second, and `p`.
    """
    pairs = list(zip(first, second, strict=True))
    one, other = pairs.count((True, False)), pairs.count((False, True))
    p = float(binomtest(one, one + other).pvalue) if one + other else 1.0
    return {"only_first": one, "only_second": other, "p": p}

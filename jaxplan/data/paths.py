"""Paths as demonstrations keep them."""

import numpy as np

from jaxplan.data.schema import PATH_POINTS


def resample(path: np.ndarray) -> tuple[np.ndarray, float]:
    """`PATH_POINTS` points of `[n, d]`, uniform in arc length, and the length [rad]."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(steps)])
    at = np.linspace(0, arc[-1], PATH_POINTS)
    return np.stack([np.interp(at, arc, joint) for joint in path.T], 1), float(arc[-1])

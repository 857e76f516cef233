"""The Franka Panda's joint limits, from the maker's control parameters."""

from typing import NamedTuple

import numpy as np

from jaxplan.config import PANDA_Q_MAX, PANDA_Q_MIN


class JointLimits(NamedTuple):
    """Limits of an arm's d joints, each `[d]`.

    Attributes:
        q_min: lower position limits [rad].
        q_max: upper position limits [rad].
        velocity: largest speeds [rad/s].
        acceleration: largest accelerations [rad/s^2].
    """

    q_min: np.ndarray
    q_max: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray


def _constant(*values: float) -> np.ndarray:
    array = np.array(values)
    array.setflags(write=False)
    return array


PANDA_LIMITS = JointLimits(
    q_min=_constant(*PANDA_Q_MIN),
    q_max=_constant(*PANDA_Q_MAX),
    velocity=_constant(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration=_constant(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
)
"""`control-parameters-joint-panda.csv` of frankaemika/docs."""

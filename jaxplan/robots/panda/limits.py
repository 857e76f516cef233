"""The Franka Panda's joint limits: `control-parameters-joint-panda.csv` of frankaemika/docs."""

import numpy as np

from jaxplan.robots.robot import JointLimits

Q_MIN = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
Q_MAX = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)


def _constant(*values: float) -> np.ndarray:
    array = np.array(values)
    array.setflags(write=False)
    return array


LIMITS = JointLimits(
    q_min=_constant(*Q_MIN),
    q_max=_constant(*Q_MAX),
    velocity=_constant(2.175, 2.175, 2.175, 2.175, 2.61, 2.61, 2.61),
    acceleration=_constant(15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0),
)

"""From a planner's waypoints to a smooth, timed and validated motion."""

from jaxplan.trajectory.shortcut import shortcut
from jaxplan.trajectory.spline import fit_polyline, fit_spline
from jaxplan.trajectory.timing import Timing, evaluate, time_parameterize
from jaxplan.trajectory.trajectory import Rung, Trajectory, make_trajectory
from jaxplan.trajectory.validation import SweptFree, Validation, points_free

__all__ = [
    "Rung",
    "SweptFree",
    "Timing",
    "Trajectory",
    "Validation",
    "evaluate",
    "fit_polyline",
    "fit_spline",
    "make_trajectory",
    "points_free",
    "shortcut",
    "time_parameterize",
]

"""From a planner's waypoints to a smooth, timed and validated motion."""

from jaxplan.trajectory.shortcut import shortcut
from jaxplan.trajectory.spline import fit_polyline, fit_spline
from jaxplan.trajectory.timing import Timing, evaluate, time_parameterize
from jaxplan.trajectory.trajectory import Rung, Trajectory, make_trajectory
from jaxplan.trajectory.validation import curve_points, line_points, points_free

__all__ = [
    "Rung",
    "Timing",
    "Trajectory",
    "curve_points",
    "evaluate",
    "fit_polyline",
    "fit_spline",
    "line_points",
    "make_trajectory",
    "points_free",
    "shortcut",
    "time_parameterize",
]

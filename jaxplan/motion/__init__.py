"""One planner core, and its two uses: a library's, and the episode loop's."""

from jaxplan.motion.executable import Motion as Motion
from jaxplan.motion.executable import MotionPlanner as MotionPlanner
from jaxplan.motion.plan import Plan as Plan
from jaxplan.motion.plan import Timed as Timed
from jaxplan.motion.planner import Planner as Planner
from jaxplan.motion.search import Search as Search
from jaxplan.motion.search import jit as jit

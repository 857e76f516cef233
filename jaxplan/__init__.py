"""Motion planning in JAX for MuJoCo models, guided by learned samplers."""

from typing import TYPE_CHECKING, Any

import jaxplan.interrupt

# Before the rest, whose import takes seconds, and imports MuJoCo.
if jaxplan.interrupt.is_command():
    jaxplan.interrupt.end_on_interrupt()
import jaxplan.simulation.gl
from jaxplan.collision import Obstacle as Obstacle
from jaxplan.collision import World as World
from jaxplan.collision import make_world as make_world
from jaxplan.config import PlannerConfig as PlannerConfig
from jaxplan.config import TrajectoryConfig as TrajectoryConfig
from jaxplan.ik import Pose as Pose
from jaxplan.motion import Plan as Plan
from jaxplan.motion import Planner as Planner
from jaxplan.planning import Segment as Segment
from jaxplan.planning import Status as Status
from jaxplan.scene import Scene as Scene

if TYPE_CHECKING:
    from jaxplan.pretrained import load_sampler as load_sampler

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """What needs Flax comes when it is asked for: who plans without networks waits less."""
    if name == "load_sampler":
        from jaxplan.pretrained import load_sampler

        return load_sampler
    raise AttributeError(f"module 'jaxplan' has no attribute {name!r}")

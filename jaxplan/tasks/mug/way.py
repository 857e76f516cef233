"""The ways that demonstrations go between keyframes.

A sampler learns the average of what it is shown, so that demonstrations must agree on the way
around an obstacle, and leave room beside it for a learned segment that is a little off. In the
plain scene nearly every way is straight. In the cluttered one the expert searches on for the
shortest way, among obstacles that it takes for thicker than they are.
"""

from dataclasses import replace

from jaxplan.config import PAPER_PLANNER, PlannerConfig
from jaxplan.motion import MotionPlanner
from jaxplan.robots import PANDA
from jaxplan.scene import Scene
from jaxplan.tasks.mug.clutter import thickened
from jaxplan.tasks.mug.scene import Variant

PLANNERS: dict[Variant, PlannerConfig] = {
    "plain": replace(PAPER_PLANNER, p_uniform=1.0),
    "cluttered": replace(
        PAPER_PLANNER,
        method="ao_rrt_connect",
        p_uniform=1.0,
        max_expansions=2000,
        workers=16,
        edge_resolution=0.0125,  # the shortest way touches the margin
    ),
}
ROOM = 0.01
"""What the expert adds to each side of an obstacle [m]."""


def expert_planner(scene: Scene, variant: Variant) -> MotionPlanner:
    """The planner of demonstrations, and of recorded problems.

    In clutter the paper's planner would not do for either: 500 uniform expansions are too few
    for many phases, and the episodes that are left would be the easy ones.
    """
    if variant == "cluttered":
        scene = thickened(scene, ROOM)
    return MotionPlanner(scene, PANDA.limits, PLANNERS[variant])

"""The motions that demonstrations take between keyframes.

A sampler learns what it is shown, so that demonstrations must agree on how they pass an obstacle
on one side, and leave room beside it for a learned segment that is a little off. In the plain
scene nearly every motion is straight. Among obstacles the expert searches on for the shortest
motion; in clutter they are thicker for it than they are.
"""

from jaxplan.motion import MotionPlanner
from jaxplan.robots import PANDA
from jaxplan.scene import Scene
from jaxplan.tasks.mug.variant import OBSTACLES, Variant


def expert_planner(scene: Scene, variant: Variant) -> MotionPlanner:
    """The planner of demonstrations, and of recorded problems.

    Among obstacles the paper's planner would not do for either: 500 uniform expansions are too
    few for many phases, and the episodes that are left would be the easy ones.
    """
    if variant.room:
        scene = thickened(scene, variant.room)
    return MotionPlanner(scene, PANDA.limits, variant.search)


def thickened(planning: Scene, by: float) -> Scene:
    """The scene with every obstacle thicker by `by` [m] on each side."""
    model = planning.mj_model
    obstacle = model.geom_bodyid == planning.body_id(OBSTACLES)
    return planning.replace(geom_size=planning.model.geom_size + by * obstacle[:, None])

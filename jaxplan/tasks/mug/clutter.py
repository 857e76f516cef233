"""The cluttered variant: obstacles across the straight lines of the long phases.

Easy phases tell nothing about a sampler. These obstacles leave every keyframe of the expert free
and hide nothing from the wrist camera at the keyframes, but stand where the arm or the mug passes
on the straight line in joint space between keyframes that lie far apart:

    obstacle         toward rim grasp   toward release   toward handle   toward box
    front_board      wrist, from above
    side_board                          forearm          forearm
    partition                                                            the mug

Each goes on outward, so that there is one way around it, inside or above, and demonstrations
agree on it.
"""

from dataclasses import replace

from jaxplan.config import PAPER_PLANNER
from jaxplan.tasks.mug.variant import Slab, Variant

CLUTTERED = Variant(
    obstacles=(
        Slab("front_board", low=(0.48, 0.085, 0.605), high=(0.75, 0.105, 0.90)),
        Slab("side_board", low=(0.33, -0.35, 0.63), high=(0.35, -0.10, 0.90)),
        Slab("partition", low=(0.40, -0.220, 0.0), high=(0.70, -0.204, 0.115)),
    ),
    search=replace(
        PAPER_PLANNER,
        method="ao_rrt_connect",
        p_uniform=1.0,
        max_expansions=2000,
        workers=16,
        edge_resolution=0.0125,  # the shortest way touches the margin
    ),
    room=0.01,
)

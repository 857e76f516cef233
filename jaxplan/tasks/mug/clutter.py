"""What the cluttered variant adds: obstacles across the straight lines of the long phases.

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

from typing import Any, NamedTuple

import mujoco
import numpy as np

from jaxplan.scene import Scene


class Slab(NamedTuple):
    """A box, parallel to the axes, between two corners [m]."""

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]


OBSTACLES = (
    Slab("front_board", low=(0.48, 0.085, 0.605), high=(0.75, 0.105, 0.90)),
    Slab("side_board", low=(0.33, -0.35, 0.63), high=(0.35, -0.10, 0.90)),
    Slab("partition", low=(0.40, -0.220, 0.0), high=(0.70, -0.204, 0.115)),
)


def add_clutter(
    scene: mujoco.MjSpec,
    physics: dict[str, Any],
    planning: dict[str, Any],
    visual: dict[str, Any],
) -> None:
    """Adds a body `clutter` to the scene.

    It is a body of its own, so that the contacts that some phases allow, of the mug with the
    table, do not allow any with obstacles.

    Args:
        scene: What is added to.
        physics: Attributes of the geoms that physics touches.
        planning: Of those that planning checks.
        visual: Of those that a camera sees.
    """
    scene.add_material(name="clutter", rgba=[0.55, 0.36, 0.30, 1], specular=0.2)
    body, look = scene.worldbody.add_body(name="clutter"), {"material": "clutter"}
    for name, low, high in OBSTACLES:
        corners = np.array([low, high])
        box = {
            "type": mujoco.mjtGeom.mjGEOM_BOX,
            "pos": corners.mean(0),
            "size": np.ptp(corners, axis=0) / 2,
        }
        body.add_geom(name=name, **box, **look, **physics)
        body.add_geom(name=f"{name}_planning", **box, **planning)
        body.add_geom(name=f"{name}_visual", **box, **look, **visual)


def thickened(planning: Scene, by: float) -> Scene:
    """The scene with every obstacle thicker by `by` [m] on each side."""
    model = planning.mj_model
    obstacle = model.geom_bodyid == planning.body_id("clutter")
    return planning.replace(geom_size=planning.model.geom_size + by * obstacle[:, None])

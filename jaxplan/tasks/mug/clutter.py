"""What the cluttered variant adds: obstacles across the straight lines of the long phases.

Easy phases tell nothing about a sampler. These obstacles leave every keyframe of the expert
free, and what the wrist camera looks for in sight, but stand where the arm or the mug would
pass on the straight line in joint space between two keyframes that lie far apart.
"""

from typing import Any, NamedTuple

import mujoco

RADIUS = 0.012
"""Of a rod [m]."""
TOP = 0.90
"""Where hanging rods end [m]: above anything that the arm does."""


class Rod(NamedTuple):
    """A vertical capsule that hangs from above, or stands on the table."""

    name: str
    x: float
    y: float
    low: float
    high: float = TOP
    """All [m]."""


class Wall(NamedTuple):
    """A box that stands on the table."""

    name: str
    x: tuple[float, float]
    y: tuple[float, float]
    height: float
    """All [m]."""


OBSTACLES: tuple[Rod | Wall, ...] = (
    Rod("lamp", x=0.53, y=-0.05, low=0.46),
    Rod("shoulder_rod", x=0.37, y=-0.11, low=0.58),
    Rod("front_rod", x=0.49, y=0.09, low=0.60),
    Wall("partition", x=(0.44, 0.60), y=(-0.220, -0.204), height=0.14),
)


def add_clutter(
    scene: mujoco.MjSpec,
    physics: dict[str, Any],
    planning: dict[str, Any],
    visual: dict[str, Any],
) -> None:
    """Adds a body `clutter` to the scene.

    It is a body of its own, so that no phase's allowed contacts (mug and table) allow its
    contacts too.

    Args:
        scene: What is added to.
        physics: Attributes of the geoms that physics touches.
        planning: Of those that planning checks.
        visual: Of those that a camera sees.
    """
    scene.add_material(name="clutter", rgba=[0.55, 0.36, 0.30, 1], specular=0.2)
    body = scene.worldbody.add_body(name="clutter")
    for obstacle in OBSTACLES:
        shape, look = _geom(obstacle), {"material": "clutter"}
        name = obstacle.name
        body.add_geom(name=name, **shape, **look, **physics)
        body.add_geom(name=f"{name}_planning", **shape, **planning)
        body.add_geom(name=f"{name}_visual", **shape, **look, **visual)


def _geom(obstacle: Rod | Wall) -> dict[str, Any]:
    """Type, position and size of an obstacle's geom."""
    if isinstance(obstacle, Rod):
        low, high = obstacle.low + RADIUS, obstacle.high - RADIUS
        return {
            "type": mujoco.mjtGeom.mjGEOM_CAPSULE,
            "pos": [obstacle.x, obstacle.y, (low + high) / 2],
            "size": [RADIUS, (high - low) / 2, 0],
        }
    (x0, x1), (y0, y1) = obstacle.x, obstacle.y
    half = [(x1 - x0) / 2, (y1 - y0) / 2, obstacle.height / 2]
    return {
        "type": mujoco.mjtGeom.mjGEOM_BOX,
        "pos": [(x0 + x1) / 2, (y0 + y1) / 2, obstacle.height / 2],
        "size": half,
    }

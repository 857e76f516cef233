"""What a variant of the mug's scene may differ in, and how obstacles get into a model."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import mujoco
import numpy as np

from jaxplan.collision.obstacles import Obstacle
from jaxplan.config import PAPER_PLANNER, PlannerConfig

BOX = (0.45, -0.36, 0.0)
"""Where the target box stands, but for variants that say otherwise [m]."""
OBSTACLES = "clutter"
"""The body of them all: of its own, so that the contacts that some phases allow, of the mug with
the table, do not allow any with obstacles."""


class Slab(NamedTuple):
    """A box, parallel to the axes, between two corners [m]."""

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]

    @property
    def middle(self) -> np.ndarray:
        """`[3]` [m]."""
        return (np.array(self.low) + self.high) / 2

    @property
    def half(self) -> np.ndarray:
        """Half of its sides, `[3]` [m]."""
        return (np.array(self.high) - self.low) / 2

    @property
    def obstacle(self) -> Obstacle:
        """The same for a planner's slots."""
        return Obstacle("box", self.half.tolist(), self.middle.tolist())


class Variant(NamedTuple):
    """A scene of the task."""

    obstacles: tuple[Slab, ...] = ()
    box: tuple[float, float, float] = BOX
    """Where the target box stands [m]."""
    zones: Mapping[str, Slab] = MappingProxyType({})
    """Ways past the obstacles by name, and the zone that closes each: one that hand and mug keep
    out of. An episode has at most one of them."""
    search: PlannerConfig = replace(PAPER_PLANNER, p_uniform=1.0)
    """Of demonstrations' motions."""
    room: float = 0.0
    """They keep so much farther from obstacles [m]."""


def add_obstacles(
    scene: mujoco.MjSpec,
    obstacles: tuple[Slab, ...],
    physics: dict[str, Any],
    planning: dict[str, Any],
    visual: dict[str, Any],
) -> None:
    """Adds the body of them to the scene.

    Args:
        scene: What is added to.
        obstacles: What is added.
        physics: Attributes of the geoms that physics touches.
        planning: Of those that planning checks.
        visual: Of those that a camera sees.
    """
    scene.add_material(name=OBSTACLES, rgba=[0.55, 0.36, 0.30, 1], specular=0.2)
    body, look = scene.worldbody.add_body(name=OBSTACLES), {"material": OBSTACLES}
    for slab in obstacles:
        box = {
            "type": mujoco.mjtGeom.mjGEOM_BOX,
            "pos": slab.middle,
            "size": slab.half,
        }
        body.add_geom(name=slab.name, **box, **look, **physics)
        body.add_geom(name=f"{slab.name}_planning", **box, **planning)
        body.add_geom(name=f"{slab.name}_visual", **box, **look, **visual)

"""Objects whose geoms' places and sizes are given with each query."""

from collections.abc import Iterable, Sequence

import mujoco

from jaxplan.scene.contacts import Contact
from jaxplan.scene.names import geom_name, known

SHAPEABLE = ("sphere", "capsule", "cylinder", "ellipsoid", "box")
"""Kinds of geoms whose sizes say all of their shape."""


def shaped_geoms(
    model: mujoco.MjModel,
    names: tuple[str, ...],
    objects: list[int],
    shaped: Sequence[str],
    contacts: Iterable[Contact],
) -> tuple[int, ...]:
    """Geoms of shaped objects that can touch something.

    Raises:
        ValueError: An object is none, or one of its geoms is a mesh.
    """
    movable = [names[body] for body in objects]
    bodies = {names.index(known(name, "movable object", movable)) for name in shaped}
    sides = {side for contact in contacts for side in contact}
    own = [side for side in sides if side.body in bodies]
    for side in own:
        if side.kind not in SHAPEABLE:
            name = geom_name(model, names, side.ids[0])
            raise ValueError(
                f"{name!r} is a {side.kind}, which has no size to be given: "
                f"{', '.join(SHAPEABLE)} have"
            )
    return tuple(sorted({geom for side in own for geom in side.ids}))

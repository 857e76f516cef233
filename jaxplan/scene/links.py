"""The kinematic tree, one joint at a time, as forward kinematics goes through it."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco


class Link(NamedTuple):
    """One step of the kinematic tree: a frame that one joint at most moves.

    A body with several joints is several links; its frame is that of the last.
    """

    body: int
    offset: bool
    """Starts with the body's own offset from its parent: its first link does."""
    parent: int
    """Row of the link that it hangs on; 0 = the world."""
    joint: int
    """Joint id, or -1."""
    slides: bool
    variable: int
    """Its joint's index in `Structure.variables`, or -1."""
    object: int
    """Its index in the movable objects, or -1."""


def read_links(
    model: mujoco.MjModel,
    needed: set[int],
    names: tuple[str, ...],
    variables: Sequence[int],
    objects: list[int],
    base: int,
) -> tuple[tuple[Link, ...], dict[int, int]]:
    """Links of the bodies that are needed, and the row of each body.

    Args:
        model: The model.
        needed: Bodies, with all above them.
        names: Of joints, by id.
        variables: Ids of joints, as `Structure.variables`.
        objects: Bodies of the movable objects.
        base: The root of the hand's tree, perhaps one of them: it is never held.
    """
    free = {body: i for i, body in enumerate(objects)}
    hung = {b for b in needed if model.body_rootid[b] in free.keys() - {base}}
    rank = {b: (b in hung) + (b in hung and b not in free) for b in needed}
    links: list[Link] = []
    row = {0: 0}
    for body in sorted(needed, key=lambda b: (rank[b], b)):
        parent = row[0 if body in free else int(model.body_parentid[body])]
        first = int(model.body_jntadr[body])
        ids = range(first, first + int(model.body_jntnum[body]))
        if body in free or not ids:
            links.append(Link(body, True, parent, -1, False, -1, free.get(body, -1)))
        for j in ids if body not in free else ():
            if j not in variables:
                raise ValueError(
                    f"ball joint {names[j]!r} is not supported: the arm or something that "
                    "it can touch hangs on it; use three hinges"
                )
            slides = bool(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE)
            above = parent if j == first else len(links)
            links.append(
                Link(body, j == first, above, j, slides, variables.index(j), -1)
            )
        row[body] = len(links)
    return tuple(links), row

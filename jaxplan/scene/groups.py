"""Contact groups by the names of their bodies and geoms."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from jaxplan.scene.contacts import geom_pairs
from jaxplan.scene.names import pair_of
from jaxplan.scene.structure import Group


def mask_of(
    groups: Sequence[Group],
    bodies: Sequence[str],
    names: Iterable[str | tuple[str, str]],
) -> np.ndarray:
    """`[n_groups]` which groups are between some pairs of bodies; see `Scene.ignored`.

    Raises:
        ValueError: There is no such body.
    """
    between = [{bodies[side.body] for side in group.contacts[0]} for group in groups]
    mask = np.zeros(len(groups), bool)
    for name in names:
        pair = set(pair_of(name, bodies, [group.name for group in groups]))
        mask |= [pair == group for group in between]
    return mask


def table_of(groups: Sequence[Group], geoms: int) -> np.ndarray:
    """`[geoms, geoms]` contact group of each pair of geoms, -1 = none."""
    table = np.full((geoms, geoms), -1)
    for index, group in enumerate(groups):
        for contact in group.contacts:
            for i, j in geom_pairs(contact):
                table[i, j] = table[j, i] = index
    return table


def pairs_of(groups: Sequence[Group], name: Callable[[int], str]) -> list[tuple]:
    """(group, geom, geom) of every pair, by name."""
    return [
        (group.name, name(i), name(j))
        for group in groups
        for contact in group.contacts
        for i, j in geom_pairs(contact)
    ]

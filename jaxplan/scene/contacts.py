"""Which geoms of a model can touch: MuJoCo's own filter, answered once, on the host.

A pair of geoms is checked when

    listed under <contact><pair>                      yes
    excluded or welded together or parent and child   no
    contype of one & conaffinity of the other         yes

Pairs are kept as rectangles, all geoms of one kind on one body against all of one
kind on another, because a rectangle is one array expression in the collision engine.
Boxes in one rectangle are parallel as well: the engine turns the points once for all.
"""

from collections.abc import Collection, Iterable
from itertools import combinations, product
from typing import NamedTuple

import mujoco
import numpy as np

KINDS = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
    int(mujoco.mjtGeom.mjGEOM_SDF): "sdf",
    int(mujoco.mjtGeom.mjGEOM_HFIELD): "hfield",
    int(mujoco.mjtGeom.mjGEOM_PLANE): "plane",
}
"""Names of geom kinds; of a pair, the kind named first here comes first."""


class Geoms(NamedTuple):
    """Geoms of one kind on one body."""

    body: int
    kind: str
    ids: tuple[int, ...]


class Contact(NamedTuple):
    """All geoms of `a` against all of `b`.

    `a` has the kind that comes first in `KINDS`, and of one kind the later body: so the
    few obstacles that many spheres face end up in `b`.
    """

    a: Geoms
    b: Geoms


def find_contacts(
    model: mujoco.MjModel, excluded: Collection[tuple[int, int]] = ()
) -> tuple[Contact, ...]:
    """Every pair of geoms that MuJoCo would check, as rectangles.

    Args:
        model: The model.
        excluded: Pairs `(i, j)` of geoms, i < j, that are left out.
    """
    geoms = _alike(model)
    contacts = []
    for body_1, body_2 in combinations(range(model.nbody), 2):
        if _bodies_filtered(model, body_1, body_2):
            continue
        for a, b in product(geoms[body_1], geoms[body_2]):
            if _bits_meet(model, a.ids[0], b.ids[0]) and {a.kind, b.kind} != {"plane"}:
                contacts.append(_ordered(a, b))
    known = {pair for contact in contacts for pair in geom_pairs(contact)}
    for i, j in zip(model.pair_geom1, model.pair_geom2, strict=True):
        a, b = (
            Geoms(int(model.geom_bodyid[g]), kind_of(model, g), (int(g),))
            for g in (i, j)
        )
        if (int(i), int(j)) not in known and (int(j), int(i)) not in known:
            contacts.append(_ordered(a, b))
    return tuple(part for contact in contacts for part in _without(contact, excluded))


def geom_pairs(contact: Contact) -> list[tuple[int, int]]:
    """The pairs of geom ids that a rectangle stands for."""
    return list(product(contact.a.ids, contact.b.ids))


def refuse_unsupported(model: mujoco.MjModel, contacts: Iterable[Contact]) -> None:
    """Names a geom that planning cannot check, rather than to look past it.

    Raises:
        ValueError: A contact is of such a geom.
    """
    for side in (side for contact in contacts for side in contact):
        if side.kind in ("hfield", "sdf"):
            name = model.geom(side.ids[0]).name or f"geom {side.ids[0]}"
            long = {"hfield": "a height field", "sdf": "a signed distance field"}
            raise ValueError(
                f"{name!r} is {long[side.kind]}, which is not supported: use a mesh or "
                "boxes, or set its contype and conaffinity to 0"
            )


def _without(contact: Contact, excluded: Collection[tuple[int, int]]) -> list[Contact]:
    """The rectangles that are left of one."""
    rows: dict[tuple[int, ...], list[int]] = {}
    for i in contact.a.ids:
        kept = [j for j in contact.b.ids if (min(i, j), max(i, j)) not in excluded]
        rows.setdefault(tuple(kept), []).append(i)
    return [
        Contact(contact.a._replace(ids=tuple(ids)), contact.b._replace(ids=kept))
        for kept, ids in rows.items()
        if kept
    ]


def _alike(model: mujoco.MjModel) -> list[list[Geoms]]:
    """Geoms of each body, put together where kind, contact bits and box axes agree."""
    alike: list[dict[tuple, list[int]]] = [{} for _ in range(model.nbody)]
    for geom in range(model.ngeom):
        sets = alike[model.geom_bodyid[geom]]
        bits = int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])
        kind = kind_of(model, geom)
        first = next(
            (
                ids[0]
                for (k, bs, _), ids in sets.items()
                if (k, bs) == (kind, bits)
                and (kind != "box" or _parallel(model, geom, ids[0]))
            ),
            geom,
        )
        sets.setdefault((kind, bits, first), []).append(geom)
    return [
        [Geoms(body, kind, tuple(ids)) for (kind, _, _), ids in sets.items()]
        for body, sets in enumerate(alike)
    ]


def _parallel(model: mujoco.MjModel, i: int, j: int) -> bool:
    """Whether the axes of two geoms of a body agree, up to order and sign."""
    a, b = np.zeros(9), np.zeros(9)
    mujoco.mju_quat2Mat(a, model.geom_quat[i])
    mujoco.mju_quat2Mat(b, model.geom_quat[j])
    cosines = np.abs(a.reshape(3, 3).T @ b.reshape(3, 3))
    return bool((np.minimum(cosines, 1 - cosines) < 1e-9).all())


def _bodies_filtered(model: mujoco.MjModel, body_1: int, body_2: int) -> bool:
    if (body_1 << 16) + body_2 in model.exclude_signature:
        return True
    weld = model.body_weldid
    weld_1, weld_2 = weld[body_1], weld[body_2]
    if weld_1 == weld_2:
        return True
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        return False
    parent_1, parent_2 = (weld[model.body_parentid[w]] for w in (weld_1, weld_2))
    # Children of the world are not filtered against it: weld id 0.
    return bool(weld_1 and weld_2 and (weld_1 == parent_2 or weld_2 == parent_1))


def _bits_meet(model: mujoco.MjModel, i: int, j: int) -> bool:
    contype, conaffinity = model.geom_contype, model.geom_conaffinity
    meets = (contype[i] & conaffinity[j]) | (contype[j] & conaffinity[i])
    return bool(np.any(meets))


def _ordered(a: Geoms, b: Geoms) -> Contact:
    order = list(KINDS.values())
    return Contact(*sorted((a, b), key=lambda g: (order.index(g.kind), -g.body)))


def kind_of(model: mujoco.MjModel, geom: int) -> str:
    """The name of a geom's kind, as in `KINDS`."""
    return KINDS[int(model.geom_type[geom])]

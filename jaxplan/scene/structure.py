"""The static half of a scene: names, the kinematic tree, and what can touch what."""

import dataclasses
import difflib
from collections.abc import Sequence
from typing import NamedTuple

import mujoco

from jaxplan.scene.contacts import Contact, find_contacts, kind_of

SLOTS = "obstacles"
"""The body whose geoms are slots."""
SIMPLE_JOINTS = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)


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
    """Its joint's index in (q, passive joints), or -1."""
    object: int
    """Its index in the movable objects, or -1."""


class Group(NamedTuple):
    """All contacts between two bodies: the unit that a phase allows or forbids."""

    name: str
    contacts: tuple[Contact, ...]
    held: tuple[int, ...]
    """Objects of which one must be held for the contact to depend on q; () = always."""


class Slot(NamedTuple):
    """A geom whose pose and size are given with each query."""

    geom: int
    kind: str


@dataclasses.dataclass(frozen=True, eq=False)
class Structure:
    """What does not change when a geom moves. Compared by identity, so cheap under jit."""

    mj_model: mujoco.MjModel
    joints: tuple[str, ...]
    passive: tuple[str, ...]
    objects: tuple[str, ...]
    hand: str
    slots: tuple[Slot, ...]
    groups: tuple[Group, ...]
    links: tuple[Link, ...]
    """Links that collision needs, row 1 first (row 0 is the world). Parents stand before
    children, then the movable objects, which the hand may hold, then what hangs on them."""
    link_of: dict[int, int]
    """Row of a body's frame, by body id."""


def read_structure(
    model: mujoco.MjModel, joints: Sequence[str] | None, hand: str | None
) -> Structure:
    """Reads names, tree and contacts; `Scene.from_mjcf` says what None means.

    Raises:
        ValueError: A joint or body is not in the model, or cannot be planned for.
    """
    if model.nflex:
        raise ValueError("flexes are not supported: the model has a deformable body")
    chain, end = _chain(model)
    joints = chain if joints is None else tuple(joints)
    if not joints:
        raise ValueError("the model has no hinge or slide joint to plan for")
    every = [model.joint(j).name for j in range(model.njnt)]
    for name in joints:
        if model.joint(known(name, "joint", every)).type[0] not in SIMPLE_JOINTS:
            raise ValueError(f"joint {name!r} is neither a hinge nor a slide")
    bodies = [model.body(b).name for b in range(model.nbody)]
    hand = known(hand or end, "body", bodies)
    passive = tuple(
        name
        for name in every
        if model.joint(name).type[0] in SIMPLE_JOINTS and name not in joints
    )
    free = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    objects = tuple(model.body(b).name for b in free)
    slots = tuple(
        Slot(g, kind_of(model, g))
        for g in range(model.ngeom)
        if model.body(model.geom_bodyid[g]).name == SLOTS
    )
    groups = _groups(model, joints, objects)
    needed = {int(model.body(hand).id)}
    for group in groups:
        needed |= {side.body for contact in group.contacts for side in contact}
    needed = {a for body in needed for a in _line(model, body)}
    links, link_of = _links(model, needed, (*joints, *passive), objects)
    return Structure(
        model, joints, passive, objects, hand, slots, groups, links, link_of
    )


def known(name: str, kind: str, names: Sequence[str]) -> str:
    """The name itself if it is among `names`, else a ValueError that suggests one."""
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
    raise ValueError(f"no {kind} {name!r}: {hint}")


def _chain(model: mujoco.MjModel) -> tuple[tuple[str, ...], str]:
    """Joints from the root down until the tree branches, and the last body before."""
    jointed = [b for b in range(1, model.nbody) if _simple_joints(model, b)]
    names: list[str] = []
    end = 0
    while True:
        below = [b for b in jointed if end in [*_line(model, b)[1:], 0]]
        heads = [b for b in below if not set(_line(model, b)[1:]) & set(below)]
        if len(heads) != 1:
            end = int(model.body_parentid[heads[0]]) if heads else end
            return tuple(names), model.body(end).name
        end = heads[0]
        names += [model.joint(j).name for j in _simple_joints(model, end)]


def _groups(
    model: mujoco.MjModel, joints: tuple[str, ...], objects: tuple[str, ...]
) -> tuple[Group, ...]:
    """Contacts by pair of bodies.

    A contact that q cannot change (a free object on the table) counts only while one
    of its objects is held; without an object it never counts.
    """
    named: dict[str, list[Contact]] = {}
    for contact in find_contacts(model):
        name = "|".join(sorted(model.body(side.body).name for side in contact))
        named.setdefault(name, []).append(contact)
    arm = {int(model.joint(name).bodyid[0]) for name in joints}
    groups = []
    for name, contacts in named.items():
        lines = [_line(model, side.body) for side in contacts[0]]
        moved = any(arm & set(line) for line in lines)
        roots = [model.body(line[-1]).name for line in lines if line]
        held = tuple(objects.index(root) for root in roots if root in objects)
        if moved or held:
            _refuse_unsupported(model, contacts)
            groups.append(Group(name, tuple(contacts), () if moved else held))
    return tuple(groups)


def _refuse_unsupported(model: mujoco.MjModel, contacts: list[Contact]) -> None:
    """Names a geom that planning cannot check, rather than to look past it."""
    for side in (side for contact in contacts for side in contact):
        if side.kind in ("hfield", "sdf"):
            name = model.geom(side.ids[0]).name or f"geom {side.ids[0]}"
            long = {"hfield": "a height field", "sdf": "a signed distance field"}
            raise ValueError(
                f"{name!r} is {long[side.kind]}, which is not supported: use a mesh or "
                "boxes, or set its contype and conaffinity to 0"
            )


def _links(
    model: mujoco.MjModel,
    needed: set[int],
    variables: tuple[str, ...],
    objects: tuple[str, ...],
) -> tuple[tuple[Link, ...], dict[int, int]]:
    """Links of the bodies that are needed, and the row of each body."""
    free = {int(model.body(name).id): i for i, name in enumerate(objects)}
    rank = {b: 1 if b in free else 2 * (model.body_rootid[b] in free) for b in needed}
    links: list[Link] = []
    row = {0: 0}
    for body in sorted(needed, key=lambda b: (rank[b], b)):
        parent = row[0 if body in free else int(model.body_parentid[body])]
        first = model.body_jntadr[body]
        ids = range(first, first + model.body_jntnum[body])
        if body in free or not ids:
            links.append(Link(body, True, parent, -1, False, -1, free.get(body, -1)))
        for j in ids if body not in free else ():
            name = model.joint(j).name
            if model.jnt_type[j] not in SIMPLE_JOINTS:
                raise ValueError(f"ball joint {name!r} is not supported")
            slides = bool(model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE)
            above = parent if j == first else len(links)
            links.append(
                Link(body, j == first, above, int(j), slides, variables.index(name), -1)
            )
        row[body] = len(links)
    return tuple(links), row


def _simple_joints(model: mujoco.MjModel, body: int) -> list[int]:
    first = model.body_jntadr[body]
    ids = range(first, first + model.body_jntnum[body])
    return [j for j in ids if model.jnt_type[j] in SIMPLE_JOINTS]


def _line(model: mujoco.MjModel, body: int) -> list[int]:
    """The body, its parent and so on, without the world."""
    line = []
    while body:
        line.append(int(body))
        body = model.body_parentid[body]
    return line

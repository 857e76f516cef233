"""The static half of a scene: names, the kinematic tree, and what can touch what."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from jaxplan.scene.chain import SIMPLE_JOINTS, arm_joints, last_body, line
from jaxplan.scene.contacts import Contact, find_contacts, kind_of
from jaxplan.scene.names import known, names_of


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
    body_names: tuple[str, ...]
    """By body id; what has no name is called body3, after its id."""
    joint_names: tuple[str, ...]
    """By joint id; joint4 likewise."""
    joints: tuple[str, ...]
    passive: tuple[str, ...]
    objects: tuple[str, ...]
    mocap: tuple[str, ...]
    """The last of the objects: those without a free joint."""
    hand: str
    slots: tuple[Slot, ...]
    groups: tuple[Group, ...]
    links: tuple[Link, ...]
    """Links that collision needs, row 1 first (row 0 is the world). Parents stand before
    children, then the movable objects, which the hand may hold, then what hangs on them."""
    link_of: dict[int, int]
    """Row of a body's frame, by body id."""


def read_structure(
    model: mujoco.MjModel,
    joints: Sequence[str] | None,
    hand: str | None,
    slots: str | None = None,
) -> Structure:
    """Reads names, tree and contacts; `Scene.from_mjcf` says what None means.

    Args:
        model: The compiled model.
        joints: The arm's.
        hand: A body.
        slots: The body whose geoms are slots.

    Raises:
        ValueError: A joint or body is not in the model, or cannot be planned for.
    """
    if model.nflex:
        raise ValueError("flexes are not supported: the model has a deformable body")
    bodies, every = names_of(model, "body"), names_of(model, "joint")
    joints = arm_joints(model, every) if joints is None else tuple(joints)
    if not joints:
        raise ValueError("the model has no hinge or slide joint to plan for")
    arm = [every.index(known(name, "joint", every)) for name in joints]
    for name, joint in zip(joints, arm, strict=True):
        if model.jnt_type[joint] not in SIMPLE_JOINTS:
            raise ValueError(f"joint {name!r} is neither a hinge nor a slide")
        if arm.count(joint) > 1:
            raise ValueError(f"joint {name!r} is given twice")
    moved = {int(body) for body in model.jnt_bodyid[arm]}
    end = last_body(model, int(model.jnt_bodyid[arm[-1]]))
    hand = known(bodies[end] if hand is None else hand, "body", bodies)
    passive = tuple(
        name
        for name, kind in zip(every, model.jnt_type, strict=True)
        if kind in SIMPLE_JOINTS and name not in joints
    )
    free = [
        int(b) for b in model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    ]
    mocap = [int(b) for b in np.flatnonzero(model.body_mocapid >= 0)]
    groups = _groups(model, bodies, moved, free)
    needed = {bodies.index(hand)}
    for group in groups:
        needed |= {side.body for contact in group.contacts for side in contact}
    needed = {a for body in needed for a in line(model, body)}
    variables = [every.index(name) for name in (*joints, *passive)]
    links, link_of = _links(model, needed, every, variables, [*free, *mocap])
    return Structure(
        mj_model=model,
        body_names=bodies,
        joint_names=every,
        joints=joints,
        passive=passive,
        objects=tuple(bodies[b] for b in (*free, *mocap)),
        mocap=tuple(bodies[b] for b in mocap),
        hand=hand,
        slots=tuple(
            Slot(g, kind_of(model, g))
            for g, body in enumerate(model.geom_bodyid)
            if bodies[body] == slots
        ),
        groups=groups,
        links=links,
        link_of=link_of,
    )


def only_line(structure: Structure, body: int) -> Structure:
    """The structure with no links but those of one body's line, and of the hand's where
    that may hold what the body hangs on."""
    model = structure.mj_model
    bodies, every = structure.body_names, structure.joint_names
    objects = [bodies.index(name) for name in structure.objects]
    needed = set(line(model, body))
    if needed & set(objects):
        needed |= set(line(model, bodies.index(structure.hand)))
    variables = [every.index(n) for n in (*structure.joints, *structure.passive)]
    links, link_of = _links(model, needed, every, variables, objects)
    return dataclasses.replace(structure, links=links, link_of=link_of)


def _groups(
    model: mujoco.MjModel, names: tuple[str, ...], arm: set[int], free: list[int]
) -> tuple[Group, ...]:
    """Contacts by pair of bodies.

    A contact that q cannot change (a free object on the table) counts only while one
    of its objects is held; without an object it never counts.

    Args:
        model: The model.
        names: Of bodies, by id.
        arm: Bodies that the arm's joints move first.
        free: Bodies with a free joint: objects that can be held.
    """
    named: dict[str, list[Contact]] = {}
    for contact in find_contacts(model):
        name = "|".join(sorted(names[side.body] for side in contact))
        named.setdefault(name, []).append(contact)
    groups = []
    for name, contacts in named.items():
        lines = [line(model, side.body) for side in contacts[0]]
        moved = any(arm & set(above) for above in lines)
        roots = [above[-1] for above in lines if above]
        held = tuple(free.index(root) for root in roots if root in free)
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
    names: tuple[str, ...],
    variables: list[int],
    objects: list[int],
) -> tuple[tuple[Link, ...], dict[int, int]]:
    """Links of the bodies that are needed, and the row of each body.

    Args:
        model: The model.
        needed: Bodies, with all above them.
        names: Of joints, by id.
        variables: Ids of the arm's joints, then of the passive ones.
        objects: Bodies of the movable objects.
    """
    free = {body: i for i, body in enumerate(objects)}
    rank = {b: 1 if b in free else 2 * (model.body_rootid[b] in free) for b in needed}
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

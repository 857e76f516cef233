"""The static half of a scene: names, the kinematic tree, and what can touch what."""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

from jaxplan.scene.chain import SIMPLE_JOINTS, last_body, line, read_arm
from jaxplan.scene.contacts import (
    Contact,
    find_contacts,
    geom_pairs,
    kind_of,
    refuse_unsupported,
)
from jaxplan.scene.dependent import Dependent, in_order, root_of
from jaxplan.scene.excludes import Exclude, Excludes, find_excludes
from jaxplan.scene.flexes import refuse_flexes
from jaxplan.scene.links import Link, read_links
from jaxplan.scene.loops import refuse_loops
from jaxplan.scene.names import known, names_of
from jaxplan.scene.shaped import shaped_geoms
from jaxplan.scene.touching import Moving, near_distances


class Group(NamedTuple):
    """All contacts between two bodies: the unit that a phase allows or forbids."""

    name: str
    """Both bodies with | between them, in the order of the alphabet."""
    contacts: tuple[Contact, ...]
    held: tuple[int, ...]
    """Objects of which one must be held for the contact to depend on q; () = always."""


class Slot(NamedTuple):
    """A geom whose pose and size are given with each query."""

    geom: int
    kind: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Structure:
    """What does not change when a geom moves. Compared by identity, so cheap under jit."""

    mj_model: mujoco.MjModel
    body_names: tuple[str, ...]
    """By body id; what has no name is called body3, after its id."""
    joint_names: tuple[str, ...]
    """By joint id; joint4 likewise."""
    joints: tuple[str, ...]
    passive: tuple[str, ...]
    dependent: tuple[Dependent, ...]
    """Joints that follow others, each after its master."""
    variables: tuple[int, ...]
    """Joint ids: the arm's, the passive ones, then the dependent ones."""
    moved: frozenset[int]
    """Ids of the bodies that the arm's joints, and those that follow them, move first."""
    objects: tuple[str, ...]
    mocap: tuple[str, ...]
    """The last of the objects: those without a free joint."""
    hand: str
    slots: tuple[Slot, ...]
    shaped: tuple[int, ...]
    """Ids of the geoms whose places and sizes are given with each query."""
    groups: tuple[Group, ...]
    excludes: Excludes
    links: tuple[Link, ...]
    """Links that collision needs, row 1 first (row 0 is the world). Parents stand before
    children: first the fixed trees and the hand's, then the movable objects, which the
    hand may hold, then what hangs on them."""
    link_of: dict[int, int]
    """Row of a body's frame, by body id."""

    @property
    def bases(self) -> tuple[str, ...]:
        """Objects on which the arm hangs."""
        ends = self.moved | {self.body_names.index(self.hand)}
        above = {body for end in ends for body in line(self.mj_model, end)}
        names = self.body_names
        return tuple(name for name in self.objects if names.index(name) in above)

    @property
    def shaped_objects(self) -> tuple[str, ...]:
        """Whose geoms they are."""
        bodies = self.mj_model.geom_bodyid[list(self.shaped)]
        return tuple(dict.fromkeys(self.body_names[body] for body in bodies))

    @cached_property
    def near(self) -> dict[tuple[int, int], float]:
        """Geoms `(i, j)`, i < j, of neighbours that are hardly ever farther apart than so [m].

        A margin at least as large counts as none for them: no pose keeps it.
        """
        groups = (group for group in self.groups if not group.held)
        pairs = [p for group in groups for c in group.contacts for p in geom_pairs(c)]
        motion = Moving(self.moved, self.variables, self.dependent)
        return near_distances(self.mj_model, motion, pairs)


def read_structure(
    model: mujoco.MjModel,
    joints: Sequence[str] | None,
    hand: str | None,
    slots: str | None = None,
    exclude: Exclude | Excludes = None,
    shaped: Sequence[str] = (),
) -> Structure:
    """Reads names, tree and contacts; `Scene.from_mjcf` says what None means.

    Args:
        model: The compiled model.
        joints: The arm's.
        hand: A body.
        slots: The body whose geoms are slots.
        exclude: Contacts to leave out, or what was found to be left out.
        shaped: Objects whose geoms change between queries.

    Raises:
        ValueError: A joint or body is not in the model, or cannot be planned for.
    """
    bodies, every = names_of(model, "body"), names_of(model, "joint")
    arm, drives = read_arm(model, every, joints)
    passive = [
        j
        for j, kind in enumerate(model.jnt_type)
        if kind in SIMPLE_JOINTS and j not in arm and j not in drives
    ]
    dependent = in_order(drives, [*arm, *passive])
    variables = (*arm, *passive, *(joint for joint, *_ in dependent))
    following = [j for j in drives if root_of(drives, j) in arm]
    moving = [*arm, *following]
    moved = frozenset(int(body) for body in model.jnt_bodyid[moving])
    end = last_body(model, int(model.jnt_bodyid[arm[-1]]), following)
    hand = known(bodies[end] if hand is None else hand, "body", bodies)
    free = [
        int(b) for b in model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    ]
    mocap = [int(b) for b in np.flatnonzero(model.body_mocapid >= 0)]
    refuse_loops(model, bodies, moving)
    refuse_flexes(model, moved | set(free))
    if not isinstance(exclude, Excludes):
        apart = [*free, *mocap, *([bodies.index(slots)] if slots else ())]
        motion = Moving(moved, variables, dependent)
        exclude = find_excludes(model, bodies, motion, apart, exclude)
    groups = _groups(model, bodies, moved, free, exclude)
    needed = {bodies.index(hand)}
    for group in groups:
        needed |= {side.body for contact in group.contacts for side in contact}
    needed = {a for body in needed for a in line(model, body)}
    base = int(model.body_rootid[bodies.index(hand)])
    links, link_of = read_links(model, needed, every, variables, [*free, *mocap], base)
    return Structure(
        mj_model=model,
        body_names=bodies,
        joint_names=every,
        joints=tuple(every[j] for j in arm),
        passive=tuple(every[j] for j in passive),
        dependent=dependent,
        variables=variables,
        moved=moved,
        objects=tuple(bodies[b] for b in (*free, *mocap)),
        mocap=tuple(bodies[b] for b in mocap),
        hand=hand,
        slots=tuple(
            Slot(g, kind_of(model, g))
            for g, body in enumerate(model.geom_bodyid)
            if bodies[body] == slots
        ),
        shaped=shaped_geoms(
            model,
            bodies,
            [*free, *mocap],
            shaped,
            [c for g in groups for c in g.contacts],
        ),
        groups=groups,
        excludes=exclude,
        links=links,
        link_of=link_of,
    )


def read_again(structure: Structure, model: mujoco.MjModel) -> Structure:
    """That of a changed model, with all that the structure was read with."""
    bodies = model.geom_bodyid[[slot.geom for slot in structure.slots]]
    room = structure.body_names[bodies[0]] if len(bodies) else None
    return read_structure(
        model,
        structure.joints,
        structure.hand,
        room,
        structure.excludes,
        structure.shaped_objects,
    )


def only_line(structure: Structure, body: int) -> Structure:
    """The structure with the links of one body's line only.

    Where the hand may hold what the body hangs on, the hand's line is there too.
    """
    model, bodies = structure.mj_model, structure.body_names
    hand = bodies.index(structure.hand)
    objects = [bodies.index(name) for name in structure.objects]
    needed = set(line(model, body))
    if needed & set(objects):
        needed |= set(line(model, hand))
    links, link_of = read_links(
        model,
        needed,
        structure.joint_names,
        structure.variables,
        objects,
        int(model.body_rootid[hand]),
    )
    return dataclasses.replace(structure, links=links, link_of=link_of)


def movers(structure: Structure, body: int) -> np.ndarray:
    """`[d]` bool: joints of the arm that move a body, by themselves or what follows them."""
    model = structure.mj_model
    above = np.isin(model.jnt_bodyid[list(structure.variables)], line(model, body))
    first = len(structure.variables) - len(structure.dependent)
    followers = list(enumerate(structure.dependent, first))
    for own, (_, master, _) in reversed(followers):
        if master >= 0:
            above[master] |= above[own]
    return above[: len(structure.joints)]


def _groups(
    model: mujoco.MjModel,
    names: tuple[str, ...],
    arm: frozenset[int],
    free: list[int],
    excludes: Excludes,
) -> tuple[Group, ...]:
    """Contacts by pair of bodies.

    A contact that q cannot change (a free object on the table) counts only while one
    of its objects is held; what moves both bodies alike (the arm two fingers) changes none.

    Args:
        model: The model.
        names: Of bodies, by id.
        arm: Bodies that the arm's joints move first.
        free: Bodies with a free joint: objects that can be held.
        excludes: What is left out.
    """
    between: dict[tuple[int, int], list[Contact]] = {}
    for contact in find_contacts(model, excludes.geoms):
        first, second = sorted(side.body for side in contact)
        between.setdefault((first, second), []).append(contact)
    groups = []
    for pair, contacts in between.items():
        lines = [line(model, body) for body in pair]
        apart = set(lines[0]) ^ set(lines[1])
        held = tuple(free.index(body) for body in free if body in apart)
        if arm & apart or held:
            refuse_unsupported(model, contacts)
            name = "|".join(sorted(names[body] for body in pair))
            groups.append(Group(name, tuple(contacts), () if arm & apart else held))
    return tuple(groups)

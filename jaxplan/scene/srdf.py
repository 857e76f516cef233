"""MoveIt's companion of a URDF: groups of joints, and links whose collisions are disabled."""

import warnings
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as ET

import mujoco

from jaxplan.scene.names import known
from jaxplan.scene.urdf import parse


class Srdf(NamedTuple):
    """What planning reads in it."""

    disabled: tuple[tuple[str, str], ...]
    """Pairs of links."""
    groups: dict[str, tuple[str, ...]]
    """Joints of each group, from the root down; without fixed and mimic joints."""


def read_srdf(path: str | PathLike, spec: mujoco.MjSpec) -> Srdf:
    """Reads it for a robot.

    Disabled pairs of links that the robot has not are left out with a warning, as MoveIt
    does it: one SRDF often serves several variants of a robot.

    Args:
        path: Of the SRDF.
        spec: The robot, as `read_urdf` gives it.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It is no SRDF, or a group names what does not exist.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    robot = parse(path, "robot")
    links = {body.name for body in spec.bodies}
    disabled, unknown = [], set()
    for pair in robot.findall("disable_collisions"):
        names = pair.get("link1", ""), pair.get("link2", "")
        unknown |= set(names) - links
        if links.issuperset(names):
            disabled.append(names)
    if unknown:
        warnings.warn(
            f"{path}: disable_collisions of links that the robot has not: "
            + ", ".join(sorted(unknown)),
            stacklevel=3,
        )
    elements = {group.get("name", ""): group for group in robot.findall("group")}
    try:
        groups = {name: _joints(name, elements, spec) for name in elements}
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return Srdf(tuple(disabled), groups)


def _joints(
    name: str,
    groups: dict[str, ET.Element],
    spec: mujoco.MjSpec,
    within: Sequence[str] = (),
) -> tuple[str, ...]:
    """Joints of a group: those it names, of its links, on its chains, of its subgroups."""
    if name in within:
        raise ValueError(f"group {name!r} is part of itself")
    group, found = groups[name], set()
    links = {body.name: body for body in spec.bodies}
    every = [joint.name for body in spec.bodies for joint in body.joints]

    def own(link: str) -> set[str]:
        return {joint.name for joint in links[link].joints}

    def child(element: ET.Element, key: str, kind: str, names: Sequence[str]) -> str:
        return known(element.get(key, ""), kind, names)

    for link in group.findall("link"):
        found |= own(child(link, "name", "link", list(links)))
    for joint in group.findall("joint"):
        found.add(joint.get("name", ""))  # fixed ones are no joints of the spec
    for chain in group.findall("chain"):
        base, tip = (
            child(chain, key, "link", list(links)) for key in ("base_link", "tip_link")
        )
        while tip != base:
            found |= own(tip)
            if links[tip].parent is None:
                raise ValueError(f"group {name!r}: {base!r} is not above its tip_link")
            tip = links[tip].parent.name
    for part in group.findall("group"):
        sub = child(part, "name", "group", list(groups))
        found |= set(_joints(sub, groups, spec, (*within, name)))
    mimics = {e.name1 for e in spec.equalities if e.type == mujoco.mjtEq.mjEQ_JOINT}
    return tuple(joint for joint in every if joint in found - mimics)

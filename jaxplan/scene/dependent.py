"""Joints that follow others: `<equality><joint>`, read as kinematics.

    q1 - qpos0_1 = c0 + c1 x + c2 x^2 + c3 x^3 + c4 x^4,  x = q2 - qpos0_2

joint1 is dependent, joint2 its master, which may follow a third one. A constraint of one
joint alone fixes it at qpos0 + c0.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from jaxplan.scene.intervals import Interval, image, meet, preimage, steepest


class Drive(NamedTuple):
    """What moves a joint."""

    master: int
    """Joint id, or -1: nothing does, the joint is fixed."""
    polycoef: tuple[float, ...]
    """`[5]` as MuJoCo's."""


class Dependent(NamedTuple):
    """A joint whose value follows from another's."""

    joint: int
    """Its id."""
    master: int
    """Index of its master in `Structure.variables`, before its own; -1: it is fixed."""
    polycoef: tuple[float, ...]
    """`[5]` from how far the master is from its reference to how far this joint is."""


def read_drives(model: mujoco.MjModel, names: Sequence[str]) -> dict[int, Drive]:
    """The active joint equalities, by the id of the joint that follows.

    Args:
        model: The model.
        names: Of its joints, by id.

    Raises:
        ValueError: Two of them drive one joint, some drive each other in a circle, or a
            coefficient is not finite.
    """
    drives: dict[int, Drive] = {}
    for e in active_equalities(model, mujoco.mjtEq.mjEQ_JOINT):
        joint, master = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        polycoef = tuple(map(float, model.eq_data[e, :5]))
        if not np.isfinite(polycoef).all():
            raise ValueError(
                f"equality of joint {names[joint]!r} has polycoef {list(polycoef)}, "
                "which is not finite"
            )
        if joint in drives:
            raise ValueError(
                f"joint {names[joint]!r} follows two equality constraints: give one of "
                'them active="false"'
            )
        drives[joint] = Drive(master, polycoef if master >= 0 else polycoef[:1])
    for joint in drives:
        path = [joint]
        while (above := drives.get(path[-1], Drive(-1, ())).master) >= 0:
            if above in path:
                circle = ", ".join(repr(names[j]) for j in path[path.index(above) :])
                raise ValueError(
                    f"joints {circle} follow each other in a circle: give one of their "
                    'equality constraints active="false"'
                )
            path.append(above)
    return drives


def active_equalities(model: mujoco.MjModel, *kinds: mujoco.mjtEq) -> list[int]:
    """Ids of the equality constraints of some kinds that hold from the start."""
    flags = (
        mujoco.mjtDisableBit.mjDSBL_EQUALITY | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    )
    if model.opt.disableflags & flags:
        return []
    active = np.flatnonzero(model.eq_active0)
    return [int(e) for e in active if model.eq_type[e] in [int(k) for k in kinds]]


def turn_to(
    drives: dict[int, Drive], joint: int, arm: Sequence[int], names: Sequence[str]
) -> dict[int, Drive]:
    """The drives turned round where needed, so that nothing moves `joint` of the arm.

    Args:
        drives: By joint id.
        joint: Its id.
        arm: Ids of the arm's joints, which cannot follow it.
        names: Of joints, by id.

    Raises:
        ValueError: It follows a joint of the arm, is fixed, or its master does not follow
            from it.
    """
    turned, below = dict(drives), joint
    while below in drives:
        master, polycoef = drives[below]
        if below == joint:
            turned.pop(joint)
        if master < 0:
            raise ValueError(
                f"joint {names[joint]!r} is fixed by an equality constraint"
            )
        follows = f"joint {names[joint]!r} follows joint {names[master]!r} (equality)"
        if master in arm:
            raise ValueError(f"{follows}: leave it out of the arm's joints")
        if polycoef[1] == 0 or any(polycoef[2:]):
            raise ValueError(f"{follows}, by no straight line: name that one instead")
        back = (-polycoef[0] / polycoef[1], 1 / polycoef[1], 0.0, 0.0, 0.0)
        turned[master] = Drive(below, back)
        below = master
    return turned


def root_of(drives: dict[int, Drive], joint: int) -> int:
    """The joint at the end of a line of masters; -1 where that is fixed."""
    while joint in drives:
        joint = drives[joint].master
    return joint


def in_order(drives: dict[int, Drive], free: Sequence[int]) -> tuple[Dependent, ...]:
    """The dependent joints, each after its master.

    Args:
        drives: By joint id.
        free: Ids of the joints that follow nothing, as in `Structure.variables`.
    """
    index = {joint: i for i, joint in enumerate(free)} | {-1: -1}
    rest, ordered = dict(drives), []
    while rest:
        joint = next(j for j, drive in rest.items() if drive.master in index)
        drive = rest.pop(joint)
        ordered.append(Dependent(joint, index[drive.master], drive.polycoef))
        index[joint] = len(index) - 1
    return tuple(ordered)


def follow(dependent: Sequence[Dependent], moved: Iterable[Any]) -> list[Any]:
    """How far all joints are from their references.

    Args:
        dependent: As in the structure.
        moved: For each joint that follows nothing, an array of NumPy or JAX.

    Returns:
        `moved`, and then one for each dependent joint.
    """
    moved = list(moved)
    for _, master, polycoef in dependent:
        # What is fixed has one coefficient: any joint gives it its shape.
        x, value = moved[master], 0 * moved[master]
        for c in reversed(polycoef):
            value = value * x + c
        moved.append(value)
    return moved


def spread(
    dependent: Sequence[Dependent], moved: Sequence[Any], spans: Iterable[Any]
) -> list[Any]:
    """How far all joints get from where they are, at most.

    Args:
        dependent: As in the structure.
        moved: How far all joints are from their references, as `follow` says.
        spans: For each joint that follows nothing, how far that gets at most.

    Returns:
        `spans`, and then one for each dependent joint.
    """
    spans = list(spans)
    for _, master, polycoef in dependent:
        x, span, taylor = moved[master], spans[master], list(polycoef)
        for j in range(len(taylor)):  # around x, by synthetic division
            for k in reversed(range(j, len(taylor) - 1)):
                taylor[k] = taylor[k] + x * taylor[k + 1]
        reach = 0 * span
        for c in reversed(taylor[1:]):
            reach = (reach + abs(c)) * span
        spans.append(reach)
    return spans


def narrow(
    dependent: Sequence[Dependent], limits: Sequence[Interval]
) -> list[list[Interval]]:
    """Where each joint may be, so that all that follow it are inside their own limits.

    Args:
        dependent: As in the structure.
        limits: Of all joints that move, from their references, as `follow` orders them.

    Returns:
        Intervals for each, in ascending order.
    """
    allowed = [[own] for own in limits]
    first = len(limits) - len(dependent)
    for row, (_, master, polycoef) in reversed([*enumerate(dependent, first)]):
        if master >= 0:
            inside = preimage(polycoef, allowed[row])
            allowed[master] = meet(allowed[master], inside)
    return allowed


def rates(
    dependent: Sequence[Dependent], limits: Sequence[Interval], d: int
) -> np.ndarray:
    """`[n, d]` how far each joint moves at most while one of the arm's moves by 1.

    Args:
        dependent: As in the structure.
        limits: Of the joints that follow nothing, from their references.
        d: How many of these, the first ones, are the arm's.
    """
    rows, where = list(np.eye(len(limits), d)), list(limits)
    for _, master, polycoef in dependent:
        slope = steepest(polycoef, where[master])
        rows.append(_times(rows[master], slope))
        where.append(image(polycoef, where[master]))
    return np.stack(rows)


def turns(dependent: Sequence[Dependent], free: int, d: int) -> np.ndarray:
    """`[n, d]` how many times each joint turns while one of the arm's turns once.

    NaN where it depends on where that one is.

    Args:
        dependent: As in the structure.
        free: How many joints follow nothing.
        d: How many of these, the first ones, are the arm's.
    """
    rows = list(np.eye(free, d))
    for _, master, polycoef in dependent:
        slope = np.nan if any(polycoef[2:]) else sum(polycoef[1:2])
        rows.append(_times(rows[master], slope))
    return np.stack(rows)


def _times(row: np.ndarray, slope: float) -> np.ndarray:
    """Their product; 0 times what is not finite is 0."""
    return np.multiply(
        row, slope, where=(row != 0) & (slope != 0), out=np.zeros_like(row)
    )

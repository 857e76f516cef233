"""Constraints that no kinematic tree can keep: refused by name where the arm feels them.

Loops closed by `connect` and `weld`, equalities and limits of tendons, equalities of flexes.
Those that no joint of the arm changes (a loop inside a gripper) are let through.
"""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import mujoco

from jaxplan.scene.chain import line
from jaxplan.scene.dependent import active_equalities

LOOPS = {mujoco.mjtEq.mjEQ_CONNECT: "connect", mujoco.mjtEq.mjEQ_WELD: "weld"}
FLEXES = (
    mujoco.mjtEq.mjEQ_FLEX,
    mujoco.mjtEq.mjEQ_FLEXVERT,
    mujoco.mjtEq.mjEQ_FLEXSTRAIN,
)


def refuse_loops(
    model: mujoco.MjModel, names: tuple[str, ...], moving: Iterable[int]
) -> None:
    """Names the first constraint that the arm's joints change.

    Args:
        model: The model.
        names: Of bodies, by id.
        moving: Ids of the arm's joints and of those that follow them.

    Raises:
        ValueError: There is one.
    """
    moving = set(moving)
    moved = {int(model.jnt_bodyid[joint]) for joint in moving}
    for e in active_equalities(model, *LOOPS):
        bodies = _ends(model, e)
        if changes(model, bodies, moved):
            kind = LOOPS[mujoco.mjtEq(int(model.eq_type[e]))]
            raise ValueError(
                f"{kind} {_called(model.equality(e).name, e)} ties body "
                f"{names[bodies[0]]!r} to {names[bodies[1]]!r}, and the arm's joints move "
                f"one of them: {_instead(model, bodies)}"
            )
    for e in active_equalities(model, *FLEXES):
        flex = int(model.eq_obj1id[e])
        if changes(model, flex_bodies(model, flex), moved):
            raise ValueError(
                f"the equality constraint of flex {flex_name(model, flex)} "
                'depends on the arm\'s joints, which is not supported: give it active="false"'
            )
    tied = {
        int(tendon)
        for e in active_equalities(model, mujoco.mjtEq.mjEQ_TENDON)
        for tendon in (model.eq_obj1id[e], model.eq_obj2id[e])
    }
    flags = mujoco.mjtDisableBit.mjDSBL_LIMIT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    limited = model.tendon_limited & (not model.opt.disableflags & flags)
    for tendon in range(model.ntendon):
        if not _tendon_changes(model, tendon, moving, moved):
            continue
        name = _called(model.tendon(tendon).name, tendon)
        if tendon in tied:
            raise ValueError(
                f"the equality constraint of tendon {name} depends on the arm's joints, "
                'which is not supported: give it active="false", or tie two joints '
                "with <equality><joint>"
            )
        if limited[tendon]:
            raise ValueError(
                f"tendon {name} has limits and its length depends on the arm's joints, "
                'which is not supported: give it limited="false", and the joints ranges'
            )


def changes(model: mujoco.MjModel, bodies: Iterable[int], moved: set[int]) -> bool:
    """Whether some of the bodies move against others.

    Args:
        model: The model.
        bodies: Their ids.
        moved: Ids of the bodies that the arm's joints move first.
    """
    above = {frozenset(line(model, body)) & moved for body in set(bodies)}
    return len(above) > 1


def flex_bodies(model: mujoco.MjModel, flex: int) -> set[int]:
    """Ids of the bodies that carry a flex's vertices."""
    vertices, nodes = (
        ids[first[flex] : first[flex] + count[flex]]
        for ids, first, count in (
            (model.flex_vertbodyid, model.flex_vertadr, model.flex_vertnum),
            (model.flex_nodebodyid, model.flex_nodeadr, model.flex_nodenum),
        )
    )
    return {int(body) for body in (*vertices, *nodes) if body >= 0}


def flex_name(model: mujoco.MjModel, flex: int) -> str:
    """Its name in quotes, or its number."""
    return _called(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_FLEX, flex), flex)


def _ends(model: mujoco.MjModel, equality: int) -> tuple[int, int]:
    """Ids of the two bodies; the world where there is one only."""
    ends = (max(0, int(ids[equality])) for ids in (model.eq_obj1id, model.eq_obj2id))
    if model.eq_objtype[equality] == mujoco.mjtObj.mjOBJ_SITE:
        ends = (int(model.site_bodyid[site]) for site in ends)
    first, second = ends
    return first, second


def _instead(model: mujoco.MjModel, bodies: tuple[int, int]) -> str:
    """What to do without the constraint."""
    off = 'give it active="false"'
    if any(model.body_mocapid[body] >= 0 for body in bodies):
        return f"{off} to plan without the mocap body (a teleoperation handle)"
    free = {
        int(b) for b in model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    }
    if free & {int(model.body_rootid[body]) for body in bodies}:
        return f"{off}, and carry the object with `held` of make_world"
    return f"closed loops are not supported, {off} or tie the joints with <equality><joint>"


def _tendon_changes(
    model: mujoco.MjModel, tendon: int, moving: set[int], moved: set[int]
) -> bool:
    """Whether its length depends on the arm's joints."""
    first = int(model.tendon_adr[tendon])
    wraps = range(first, first + int(model.tendon_num[tendon]))
    fixed = [w for w in wraps if model.wrap_type[w] == mujoco.mjtWrap.mjWRAP_JOINT]
    if any(int(model.wrap_objid[w]) in moving and model.wrap_prm[w] for w in fixed):
        return True
    return any(
        changes(model, pair, moved)
        for pair in pairwise(_wrapped(model, wraps))
        if -1 not in pair
    )


def _wrapped(model: mujoco.MjModel, wraps: range) -> Iterator[int]:
    """The body of each site and geom that a spatial tendon passes; -1 at a pulley."""
    for w in wraps:
        kind, item = mujoco.mjtWrap(int(model.wrap_type[w])), int(model.wrap_objid[w])
        if kind == mujoco.mjtWrap.mjWRAP_SITE:
            yield int(model.site_bodyid[item])
        elif kind in (mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER):
            yield int(model.geom_bodyid[item])
        else:
            yield -1


def _called(name: str | None, number: int) -> str:
    return repr(name) if name else f"number {number}"

"""From an MJCF to a compiled model, with room for obstacles, or one line of what is wrong."""

from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from jaxplan.ranges import Whole, check
from jaxplan.scene.names import known, names_of
from jaxplan.scene.urdf import read_urdf

SLOTS = "obstacles"
"""The body whose geoms are slots."""
SLOT_KINDS = ("sphere", "capsule", "cylinder", "ellipsoid", "box")


def check_arguments(
    source: Any,
    joints: Sequence[str] | None,
    hand: str | None,
    slots: Mapping[str, int] | None,
) -> None:
    """Refuses what `Scene.from_mjcf` cannot have been given on purpose.

    Raises:
        ValueError: An argument of the wrong type, by name.
    """
    check("source", source, str | PathLike | mujoco.MjSpec | mujoco.MjModel)
    if isinstance(joints, Sequence) and not isinstance(joints, str):
        joints = tuple(joints)
    check("joints", joints, tuple[str, ...] | None)
    check("hand", hand, str | None)
    check("slots", slots, Mapping | None)
    for kind, count in (slots or {}).items():
        check("slots: kind", kind, str)
        check(f"slots[{kind!r}]", count, Whole)


def compile_model(
    source: str | PathLike | mujoco.MjSpec | mujoco.MjModel, slots: Mapping[str, int]
) -> mujoco.MjModel:
    """The compiled model, with geoms of a body `obstacles` as slots.

    Args:
        source: An MJCF's path or text, a URDF's path, an `MjSpec` or an `MjModel`.
        slots: How many of each kind, such as `{"box": 16}`.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: What is wrong in it, in one line.
    """
    if isinstance(source, mujoco.MjModel):
        if any(slots.values()):
            raise ValueError("slots need a path, text or MjSpec; this is an MjModel")
        _refuse_not_finite(source)
        return source
    where = ""
    try:
        if not isinstance(source, str | PathLike):
            spec = source.copy()
        elif str(source).lstrip().startswith("<"):
            spec = mujoco.MjSpec.from_string(str(source))
        elif Path(source).suffix == ".urdf":
            spec = read_urdf(source)
            where = f"{source}: "
        elif Path(source).is_file():
            where = f"{source}: "
            spec = mujoco.MjSpec.from_file(str(source))
        else:
            raise FileNotFoundError(f"no such file: {source}")
        if any(slots.values()):
            _add_slots(spec, slots)
        model = spec.compile()
        _refuse_not_finite(model)
    except ValueError as error:
        raise ValueError(where + " ".join(str(error).split())) from None
    return model


def _add_slots(spec: mujoco.MjSpec, slots: Mapping[str, int]) -> None:
    """Adds the body `obstacles` with geoms of size 1 that can touch what touches anything.

    Geoms without contact bits touch only what an explicit pair names: so each of those
    that is in a pair gets one with each slot.
    """
    if spec.body(SLOTS) is not None:
        raise ValueError(
            f"slots need the name {SLOTS!r}, which a body of the model has"
        )
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    silent = [
        geom.name
        for geom in spec.geoms
        if geom.name in paired and not (geom.contype or geom.conaffinity)
    ]
    body = spec.worldbody.add_body(name=SLOTS)
    for kind, count in slots.items():
        code = getattr(
            mujoco.mjtGeom, f"mjGEOM_{known(kind, 'kind', SLOT_KINDS).upper()}"
        )
        for i in range(count):
            slot = body.add_geom(
                name=f"{kind}{i}",
                type=code,
                size=[1, 1, 1],
                pos=[0, 0, 0],
                contype=2**31 - 1,
                conaffinity=2**31 - 1,
                mass=0,
                group=3,
            )
            for name in silent:
                spec.add_pair(geomname1=slot.name, geomname2=name)


def _refuse_not_finite(model: mujoco.MjModel) -> None:
    """Names the first geom, body or joint with a number that is not finite."""
    geoms = [model.geom(g).name or f"geom{g}" for g in range(model.ngeom)]
    bodies, joints = names_of(model, "body"), names_of(model, "joint")
    elements = (
        ("body", bodies, ("body_pos", "body_quat")),
        ("geom", geoms, ("geom_pos", "geom_quat", "geom_size")),
        ("joint", joints, ("jnt_pos", "jnt_axis", "jnt_range")),
    )
    for kind, names, fields in elements:
        for field in fields:
            rows = np.asarray(getattr(model, field))
            for row in np.flatnonzero(~np.isfinite(rows).all(-1)):
                raise ValueError(
                    f"{kind} {names[row]!r} has {field} {rows[row].tolist()}, "
                    "which is not finite"
                )
    for address in np.flatnonzero(~np.isfinite(model.qpos0)):
        joint = joints[np.flatnonzero(model.jnt_qposadr <= address)[-1]]
        raise ValueError(
            f"joint {joint!r} has qpos0 {model.qpos0[address]}, which is not finite"
        )

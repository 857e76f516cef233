"""Names of a model's bodies and joints: every one has one."""

import difflib
from collections.abc import Sequence
from typing import Literal

import mujoco


def names_of(model: mujoco.MjModel, kind: Literal["body", "joint"]) -> tuple[str, ...]:
    """Names by id; what has none is called by its kind and id, such as body3."""
    count, get = {
        "body": (model.nbody, model.body),
        "joint": (model.njnt, model.joint),
    }[kind]
    given = [get(i).name for i in range(count)]
    names = []
    for i, name in enumerate(given):
        made = f"{kind}{i}"
        while made in given:
            made += "_"
        names.append(name or made)
    return tuple(names)


def geom_name(model: mujoco.MjModel, bodies: Sequence[str], geom: int) -> str:
    """A geom's name; body[number] where it has none.

    Args:
        model: The model.
        bodies: Names by id.
        geom: Its id.
    """
    body = model.geom_bodyid[geom]
    number = geom - model.body_geomadr[body]
    return model.geom(geom).name or f"{bodies[body]}[{number}]"


def known(name: str, kind: str, names: Sequence[str]) -> str:
    """The name itself if it is among `names`, else a ValueError that suggests one."""
    if name in names:
        return name
    near = difflib.get_close_matches(name, names, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(names)}"
    raise ValueError(f"no {kind} {name!r}: {hint}")

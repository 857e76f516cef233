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
    there = f"there are {', '.join(names)}" if names else "there is none"
    hint = f"did you mean {near[0]!r}?" if near else there
    raise ValueError(f"no {kind} {name!r}: {hint}")


def pair_of(
    name: str | tuple[str, str], bodies: Sequence[str], pairs: Sequence[str]
) -> tuple[str, str]:
    """The two bodies of a pair that is given as "a|b" or ("a", "b").

    Args:
        name: As given.
        bodies: All names; they may have a | of their own.
        pairs: Names of pairs, for the hint.

    Raises:
        ValueError: There is no such body, or there are several ways to split the name.
    """
    if not isinstance(name, str):
        if len(name) != 2:
            raise ValueError(f"{name!r} is no pair of bodies")
        first, second = (known(str(body), "body", bodies) for body in name)
        return first, second
    parts = name.split("|")
    splits = [("|".join(parts[:i]), "|".join(parts[i:])) for i in range(1, len(parts))]
    meant = [pair for pair in splits if set(pair) <= set(bodies)]
    if len({frozenset(pair) for pair in meant}) > 1:
        raise ValueError(
            f"{name!r} may be {' or '.join(map(str, meant))}: give a tuple"
        )
    if not meant:
        if pairs:
            known("|".join(sorted(parts)), "contact group", pairs)
        raise ValueError(f"{name!r} is no pair of bodies")
    return meant[0]


def shortened(names: Sequence[str]) -> str:
    """At most three names: the first, dots and the last of more."""
    shown = [names[0], "...", names[-1]] if len(names) > 3 else names
    return ", ".join(shown) or "none"

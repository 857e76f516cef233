"""Deformable bodies: let through where neither the arm nor what it may hold can touch them."""

from collections.abc import Iterable

import mujoco

from jaxplan.scene.chain import line
from jaxplan.scene.loops import flex_bodies, flex_name


def refuse_flexes(model: mujoco.MjModel, movers: Iterable[int]) -> None:
    """Names the first flex that can touch a geom, or another flex, and moves against it.

    Only contact bits and the tree are asked, no exclusions: they are for pairs of bodies.

    Args:
        model: The model.
        movers: Ids of the bodies that the arm's joints move first, and of those with a
            free joint.

    Raises:
        ValueError: There is one.
    """
    movers = frozenset(movers)
    above = [frozenset(line(model, body)) & movers for body in range(model.nbody)]
    flexes = [
        ({above[body] for body in flex_bodies(model, f)}, _bits(model, "flex", f))
        for f in range(model.nflex)
    ]
    geoms = [
        ({above[body]}, _bits(model, "geom", g))
        for g, body in enumerate(model.geom_bodyid)
    ]
    for f, (own, bits) in enumerate(flexes):
        others = geoms + flexes[:f] + flexes[f + 1 :]
        if any(
            _meet(bits, theirs) and len(own | lines) > 1 for lines, theirs in others
        ):
            raise ValueError(
                f"flex {flex_name(model, f)} is a deformable body that the arm or something "
                "it may hold can touch, which is not supported: set its contype and "
                "conaffinity to 0"
            )


def _bits(model: mujoco.MjModel, kind: str, i: int) -> tuple[int, int]:
    contype, conaffinity = (
        int(getattr(model, f"{kind}_{field}")[i])
        for field in ("contype", "conaffinity")
    )
    return contype, conaffinity


def _meet(first: tuple[int, int], second: tuple[int, int]) -> bool:
    return bool(first[0] & second[1] or second[0] & first[1])

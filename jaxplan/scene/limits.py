"""How far the arm's joints go, with what follows them."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.scene import dependent
from jaxplan.scene.intervals import Interval
from jaxplan.scene.numbers import Numbers
from jaxplan.scene.structure import Structure


def arm_limits(structure: Structure, numbers: Numbers) -> tuple[jax.Array, jax.Array]:
    """`[d]` lower and upper limits of the arm's joints [rad or m]; infinite where none is.

    Where all joints that follow one are inside their own limits: the interval around its
    reference, or else the longest. With such joints, the numbers must be concrete.

    Raises:
        ValueError: A joint of the arm has no such interval.
    """
    model, d = structure.mj_model, len(structure.joints)
    ids = np.array(structure.variables[:d])
    limited = model.jnt_limited[ids] != 0
    low = jnp.where(limited, numbers.jnt_range[ids, 0], -jnp.inf)
    high = jnp.where(limited, numbers.jnt_range[ids, 1], jnp.inf)
    if not structure.dependent:
        return low, high
    reference = np.asarray(numbers.qpos0, float)[model.jnt_qposadr[ids]]
    rooms = [
        _room(structure, joint, allowed)
        for joint, allowed in enumerate(_allowed(structure, numbers)[:d])
    ]
    narrow = reference[:, None] + np.array(rooms)
    # What nothing follows keeps its own numbers to the last bit.
    follows = np.isin(np.arange(d), [master for _, master, _ in structure.dependent])
    return jnp.where(follows, narrow[:, 0], low), jnp.where(follows, narrow[:, 1], high)


def circular(structure: Structure) -> np.ndarray:
    """`[d]` bool, see `Scene.circular`."""
    model, d = structure.mj_model, len(structure.joints)
    ids = np.array(structure.variables)
    turns = dependent.turns(structure.dependent, len(ids) - len(structure.dependent), d)
    slides = (model.jnt_type[ids] == mujoco.mjtJoint.mjJNT_SLIDE)[:, None]
    limited = (model.jnt_limited[ids] != 0)[:, None]
    whole = np.abs(turns - np.round(turns)) < 1e-9
    return ((turns == 0) | (whole & ~slides & ~limited)).all(0)


def rates(structure: Structure) -> np.ndarray:
    """`[n, d]`, see `Scene.rates`."""
    d, free = len(structure.joints), len(structure.variables) - len(structure.dependent)
    allowed = _allowed(structure, structure.mj_model)[:free]
    where = [
        _room(structure, i, own) if i < d else (-np.inf, np.inf)
        for i, own in enumerate(allowed)
    ]
    return dependent.rates(structure.dependent, where, d)


def _allowed(
    structure: Structure, numbers: Numbers | mujoco.MjModel
) -> list[list[Interval]]:
    """Where each of the `variables` may be, from its reference."""
    model, ids = structure.mj_model, np.array(structure.variables)
    reference = np.asarray(numbers.qpos0, float)[model.jnt_qposadr[ids]]
    ranges = np.asarray(numbers.jnt_range, float)[ids] - reference[:, None]
    limited = (model.jnt_limited[ids] != 0)[:, None]
    ranges = np.where(limited, ranges, (-np.inf, np.inf))
    return dependent.narrow(
        structure.dependent, [(low, high) for low, high in ranges.tolist()]
    )


def _room(structure: Structure, joint: int, allowed: list[Interval]) -> Interval:
    """The interval around the reference of a joint of the arm, or else the longest."""
    if not allowed:
        followers = [
            repr(structure.joint_names[own])
            for own, master, _ in structure.dependent
            if master == joint
        ]
        raise ValueError(
            f"joint {structure.joints[joint]!r} has no value within its limits at which "
            f"{', '.join(followers)}, which follow it, are inside theirs"
        )
    here = [(low, high) for low, high in allowed if low <= 0 <= high]
    return max(here or allowed, key=lambda interval: interval[1] - interval[0])

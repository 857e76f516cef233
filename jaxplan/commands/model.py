"""A model and its poses as people name them on the command line."""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxplan import collision
from jaxplan.collision import World, world_at_key
from jaxplan.collision.positions import couple
from jaxplan.scene import Scene
from jaxplan.scene.chain import simple_joints
from jaxplan.scene.names import known


class NamedPose(NamedTuple):
    """The arm's joints, and the rest of the model."""

    name: str
    q: np.ndarray
    """`[d]` [rad or m]."""
    qpos: np.ndarray
    """`[nq]` all of the model's; as in the key frame or the reference pose."""
    key: int | None = None
    """The key frame's id."""


def read_scene(
    path: Path,
    joints: str | None,
    hand: str | None,
    slots: Mapping[str, int] | None = None,
) -> Scene:
    """Reads an MJCF; `joints` are names with commas between them.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: What is wrong in it, in one line.
    """
    return Scene.from_mjcf(path, read_joints(joints), hand, slots)


def read_joints(joints: str | None) -> list[str] | None:
    """Names with commas between them."""
    return None if joints is None else [name.strip() for name in joints.split(",")]


def read_pose(scene: Scene, text: str, role: str) -> NamedPose:
    """A key frame by name, or as many numbers as the arm has joints, with commas between.

    Args:
        scene: The scene.
        text: What was given.
        role: What it is for, such as "start".

    Raises:
        ValueError: It is neither.
    """
    model, d = scene.mj_model, len(scene.joints)
    keys = [model.key(i).name for i in range(model.nkey) if model.key(i).name]
    parts = text.replace(",", " ").split()
    if text in keys or (len(parts) < 2 and not all(map(_is_number, parts))):
        if not keys:
            raise ValueError(
                f"{role}: no key frame {text!r}, the model has none; give {d} numbers"
            )
        try:
            key = model.key(known(text, "key frame", keys)).id
        except ValueError as error:
            raise ValueError(f"{role}: {error}") from None
        return _at_key(scene, key)
    if wrong := [part for part in parts if not _is_number(part)]:
        raise ValueError(f"{role}: {wrong[0]!r} is not a number")
    if len(parts) != d:
        raise ValueError(
            f"{role} has {len(parts)} numbers, expected {d}: {', '.join(scene.joints)}"
        )
    q = np.array(parts, float)
    for joint in np.flatnonzero(~np.isfinite(q)):
        raise ValueError(
            f"{role} is not finite: joint {scene.joints[joint]!r} is {q[joint]}"
        )
    return NamedPose(text, q, with_joints(scene, model.qpos0, q[None])[0])


class Chain(NamedTuple):
    """Joints one after the other, none of which has two after it but the last."""

    body: str
    """The first that moves."""
    joints: list[str]


def chains(scene: Scene, joints: Sequence[str]) -> list[Chain]:
    """Joints by the chain of the kinematic tree that they are on, in their order."""
    model, names = scene.mj_model, scene.structure.body_names
    heads = [body for body in range(model.nbody) if simple_joints(model, body)]
    above = {b: next((a for a in scene.line(b)[1:] if a in heads), 0) for b in heads}
    branches = Counter(above.values())
    first: dict[int, int] = {}
    for body in heads:  # parents stand before children
        up = above[body]
        first[body] = first[up] if up and branches[up] == 1 else body
    starts = [first[int(model.jnt_bodyid[scene.joint_id(name)])] for name in joints]
    runs = groupby(zip(starts, joints, strict=True), key=itemgetter(0))
    return [Chain(names[start], [name for _, name in run]) for start, run in runs]


def default_pose(scene: Scene) -> NamedPose:
    """The key frame `home`, or the first one, or the reference pose."""
    model = scene.mj_model
    keys = [model.key(i).name for i in range(model.nkey)]
    if keys:
        return _at_key(scene, keys.index("home") if "home" in keys else 0)
    return NamedPose(
        "reference", model.qpos0[scene.addresses(scene.joints)], model.qpos0.copy()
    )


def world_at(scene: Scene, pose: NamedPose) -> World:
    """Fingers, objects and mocap bodies where the pose has them."""
    if pose.key is not None:
        return world_at_key(scene, pose.key)
    return collision.world_at(scene, pose.qpos)


def with_joints(scene: Scene, qpos: np.ndarray, q: np.ndarray) -> np.ndarray:
    """`[T, nq]`: `qpos [nq]` with the arm at `q [T, d]`."""
    rows = np.tile(qpos, (len(q), 1))
    rows[:, scene.addresses(scene.joints)] = q
    couple(scene, rows)
    return rows


def _at_key(scene: Scene, key: int) -> NamedPose:
    found = scene.mj_model.key(key)
    qpos = found.qpos.copy()
    return NamedPose(repr(found.name), qpos[scene.addresses(scene.joints)], qpos, key)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True

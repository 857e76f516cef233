"""Problems of a scene as JSON has them: where from, where to, and what stands where.

    {"problems": [{"start": [0, 0.5, 1], "goal": "left",
                   "obstacles": [{"kind": "box", "size": [0.1, 0.1, 0.2], "pose": [0.4, 0, 0.2]}],
                   "objects": {"cup": [0.1, -0.5, 0.08, 1, 0, 0, 0]}}]}

A configuration is a key frame's name or numbers, a goal may also be a pose of a body,
`{"body": "hand", "position": [0.4, 0, 0.3]}` with the arguments of `jaxplan.Pose`. Obstacles and
objects are as the model has them where nothing is said.
"""

import dataclasses
import json
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxplan.collision import Obstacle, World, make_world
from jaxplan.ik import Pose
from jaxplan.scene import Scene
from jaxplan.scene.names import known


class Problem(NamedTuple):
    """Of one scene."""

    q_start: np.ndarray
    """`[d]` [rad or m]."""
    goal: np.ndarray | Pose
    """`[d]` [rad or m], or where a body is wanted."""
    world: World


def read_json(path: Path) -> dict[str, Any]:
    """An object from a JSON file.

    Raises:
        ValueError: It is none, in one line.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"{path} is not JSON: {error}") from None
    if not isinstance(found, dict):
        raise ValueError(f"{path} holds no JSON object")
    return found


def slots_of(problems: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """How many slots of each kind a scene needs for all of these."""
    most: Counter[str] = Counter()
    for problem in problems:
        most |= Counter(str(o.get("kind")) for o in problem.get("obstacles", ()))
    return dict(sorted(most.items()))


def read_problem(scene: Scene, given: Mapping[str, Any]) -> Problem:
    """A problem from its JSON object.

    Raises:
        ValueError: It makes no sense, in one line.
    """
    refuse_unknown(given, ("start", "goal", "obstacles", "objects"), "a problem")
    if missing := [name for name in ("start", "goal") if name not in given]:
        raise ValueError(f"a problem without {missing[0]}")
    goal = given["goal"]
    world = {name: given[name] for name in ("obstacles", "objects") if name in given}
    return Problem(
        configuration(scene, given["start"], "start"),
        pose(goal) if isinstance(goal, dict) else configuration(scene, goal, "goal"),
        furnished(scene, make_world(scene), world),
    )


def configuration(scene: Scene, given: Any, name: str) -> np.ndarray:
    """`[d]` from a key frame's name or numbers."""
    if isinstance(given, str):
        model = scene.mj_model
        keys = [model.key(i).name for i in range(model.nkey)]
        row = keys.index(known(given, "key frame", keys))
        return model.key_qpos[row][scene.addresses(scene.joints)]
    q = np.asarray(given, float)
    if q.shape != (len(scene.joints),) or not np.isfinite(q).all():
        raise ValueError(
            f"{name} {given!r}, expected {len(scene.joints)} numbers: "
            f"{', '.join(scene.joints)}"
        )
    return q


def pose(given: Mapping[str, Any]) -> Pose:
    """A pose of a body from its JSON object."""
    names = [field.name for field in dataclasses.fields(Pose)]
    refuse_unknown(given, names, "a pose")
    if missing := [name for name in ("body", "position") if name not in given]:
        raise ValueError(f"a pose without {missing[0]}")
    return Pose(**given)


def obstacle(given: Mapping[str, Any]) -> Obstacle:
    """An obstacle from its JSON object."""
    refuse_unknown(given, Obstacle._fields, "an obstacle")
    if missing := [name for name in Obstacle._fields if name not in given]:
        raise ValueError(f"an obstacle without {missing[0]}")
    return Obstacle(**given)


def furnished(scene: Scene, world: World, given: Mapping[str, Any]) -> World:
    """The world with the obstacles and objects of a JSON object in it.

    Raises:
        ValueError: They make no sense, in one line.
    """
    refuse_unknown(given, ("obstacles", "objects"), "a world")
    return furnish(
        scene,
        world,
        map(obstacle, given.get("obstacles", ())),
        given.get("objects", {}),
    )


def furnish(
    scene: Scene,
    world: World,
    obstacles: Iterable[Obstacle],
    objects: Mapping[str, Any],
) -> World:
    """The world with these obstacles, and some objects put somewhere else, `[3]` or `[7]`."""
    placed = np.array(world.object_pose)
    for name, where in objects.items():
        row = scene.objects.index(known(name, "object", scene.objects))
        found = np.asarray(where, float)
        if found.shape not in ((3,), (7,)) or not np.isfinite(found).all():
            raise ValueError(f"{name} at {where!r}, expected [3] or [7] numbers")
        placed[row, : len(found)] = found
    filled = make_world(scene, placed, obstacles=obstacles)
    return world._replace(
        object_pose=filled.object_pose,
        slot_pose=filled.slot_pose,
        slot_size=filled.slot_size,
    )


def refuse_unknown(given: Mapping[str, Any], names: Iterable[str], what: str) -> None:
    """Names what is in a JSON object and should not be."""
    if not isinstance(given, Mapping):
        raise ValueError(f"{given!r} is not {what}: expected an object")
    names = tuple(names)
    for name in given:
        if name not in names:
            raise ValueError(f"{what} with {name!r}, expected {', '.join(names)}")

"""Scenes of the collision benchmark: ours, and the same geoms and pairs for the peers."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
from peers import peer_model, slots_for

from jaxplan.collision import Obstacle, World, make_world
from jaxplan.collision.positions import carry, qpos_rows
from jaxplan.evaluation.motion_bench import (
    BenchProblem,
    obstacles_mjcf,
    read_problems,
    read_robot,
    robot_mjcf,
    sphere_cage,
    table,
)
from jaxplan.scene import Scene, find_contacts, geom_pairs
from jaxplan.tasks.mug.scene import build

SET = "table_pick"
"""Whose first problem is measured: the one with most obstacles."""


class Case(NamedTuple):
    """One scene, once for each side."""

    name: str
    scene: Scene
    world: World
    model: mujoco.MjModel
    """The same for C MuJoCo, as fast as we know how."""
    qpos: np.ndarray
    """`[n, nq]` the peers' joint positions, prepared."""
    q: np.ndarray
    """`[n, d]` ours [rad]."""
    robot: dict | None = None
    """Of the Panda as spheres."""
    obstacles: tuple[Obstacle, ...] = ()


def panda_cases(data: Path, rows: int) -> Iterator[Case]:
    """The Panda as 59 spheres, among obstacles of the scene and among obstacles in slots.

    Raises:
        FileNotFoundError: The data are not there.
    """
    robot = read_robot(data)
    for problem in (sphere_cage(), table()):
        scene = Scene.from_mjcf(robot_mjcf(robot, obstacles_mjcf(problem.obstacles)))
        yield _panda_case(problem.set, robot, problem, scene, make_world(scene), rows)
    problem = read_problems(data)[SET][0]
    scene = Scene.from_mjcf(robot_mjcf(robot), slots=slots_for([problem]))
    world = make_world(scene, obstacles=problem.obstacles)
    yield _panda_case(f"{SET} in slots", robot, problem, scene, world, rows)


def mug_cases(rows: int) -> Iterator[Case]:
    """The mug on the table, and the mug in the hand, below the fingers."""
    scene = Scene.from_mjcf(build("planning"))
    held = make_world(scene, [[0.0, 0, 0.19, 1, 0, 0, 0]], [True], [0.002, 0.002])
    worlds = {"mug on the table": make_world(scene), "mug in the hand": held}
    for name, world in worlds.items():
        model = _mug_model(scene, held=bool(world.held.any()))
        q = _random(scene, rows)
        yield Case(name, scene, world, model, _mug_states(scene, model, world, q), q)


def _panda_case(
    name: str, robot: dict, problem: BenchProblem, scene: Scene, world: World, rows: int
) -> Case:
    model = peer_model(robot, problem.obstacles)
    _cheapest(model)
    _same_pairs(scene, model, held=True)
    q = _random(scene, rows)
    qpos = q.astype(float)
    return Case(name, scene, world, model, qpos, q, robot, problem.obstacles)


def _random(scene: Scene, rows: int) -> np.ndarray:
    rng, shape = np.random.default_rng(0), (rows, len(scene.joints))
    return rng.uniform(scene.q_min, scene.q_max, shape).astype(np.float32)


def _mug_model(scene: Scene, held: bool) -> mujoco.MjModel:
    """The mug's model with exactly the pairs that count on our side.

    A mug that is not held does not move with the arm, so nothing that is at rest is
    checked against it.
    """
    model = build("planning")
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    if not held:
        mug_spheres = [name.startswith("mug_sphere") for name in names]
        base = [name.startswith("link0_") for name in names]
        model.geom_contype[mug_spheres] = 0
        # The base keeps its bits for the arm and gives up those of the mug's boxes.
        model.geom_conaffinity[base] &= ~model.geom("mug_wall0").contype
    _cheapest(model)
    _same_pairs(scene, model, held)
    return model


def _cheapest(model: mujoco.MjModel) -> None:
    """Contacts become the cheapest constraints, without friction."""
    model.geom_condim[:], model.opt.cone = 1, mujoco.mjtCone.mjCONE_PYRAMIDAL


def _same_pairs(scene: Scene, model: mujoco.MjModel, held: bool) -> None:
    counted = [g for g in scene.groups if held or not g.held]
    ours = sum(len(geom_pairs(c)) for g in counted for c in g.contacts)
    theirs = sum(len(geom_pairs(c)) for c in find_contacts(model))
    if ours != theirs:
        raise RuntimeError(f"{ours} pairs on our side, {theirs} on the peers'")


def _mug_states(
    scene: Scene, model: mujoco.MjModel, world: World, q: np.ndarray
) -> np.ndarray:
    """`[n, nq]` joint positions, a held mug already carried to where the hand is."""
    leaves: list[Any] = [np.broadcast_to(x, (len(q), *x.shape)) for x in world]
    rows, data = qpos_rows(scene, World(*leaves), q), mujoco.MjData(model)
    for row in rows:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        carry(scene, data, np.asarray(world.held))
        row[:] = data.qpos
    return rows

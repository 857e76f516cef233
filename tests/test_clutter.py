"""The cluttered variant: straight lines are blocked, keyframes and the camera's view are not."""

from typing import NamedTuple

import jax
import mujoco
import numpy as np
import pytest

from jaxplan.collision import World, certify, make_world
from jaxplan.demonstrations import ExpertAgent
from jaxplan.episodes import run_episodes
from jaxplan.evaluation.certification import Certification
from jaxplan.robots import PANDA
from jaxplan.robots.kinematics import InverseKinematics
from jaxplan.scene import Scene
from jaxplan.tasks.mug import poses, scene
from jaxplan.tasks.mug.expert import Expert, Toggle
from jaxplan.tasks.mug.mug import MugShape
from jaxplan.tasks.mug.task import MugTask, allowed_contacts
from jaxplan.tasks.poses import from_matrix

SHAPE = MugShape()
LONG = {
    (Toggle.GRASP1, 3),
    (Toggle.RELEASE1, 2),
    (Toggle.GRASP2, 3),
    (Toggle.RELEASE2, 2),
}
"""Toggle, and how many keyframes are left: transits of an empty hand, carrying."""


class Problem(NamedTuple):
    """What a phase asks of the planner, if everything before it went as meant."""

    toggle: Toggle
    left: int
    q_start: np.ndarray
    q_goal: np.ndarray
    mug: np.ndarray
    """(4, 4) in the world, or in the hand while held."""
    held: bool


def lying(seed: int) -> np.ndarray:
    """The mug of a seed at rest, without physics: its pitch and drop left out."""
    position, rotation = poses.sample_pose(seed)
    axis = rotation[:, 2] * [1, 1, 0]
    axis /= np.linalg.norm(axis)
    side = np.cross([0, 0, 1.0], axis)
    rest = np.arcsin(SHAPE.radius / SHAPE.handle_reach)
    sign = np.sign(rotation[:, 0] @ side)
    handle = sign * np.cos(rest) * side - [0, 0, np.sin(rest)]
    mug = np.eye(4)
    mug[:3, :3] = np.stack([handle, np.cross(axis, handle), axis], 1)
    mug[:3, 3] = [*position[:2], SHAPE.radius]
    return mug


def problems(model: mujoco.MjModel, seed: int) -> list[Problem]:
    """The phases of the expert's episode, from kinematics alone."""
    expert = Expert(InverseKinematics(PANDA, model))
    data = mujoco.MjData(model)

    def hand(q):
        data.qpos[:7] = q
        mujoco.mj_kinematics(model, data)
        pose = np.eye(4)
        pose[:3, :3] = data.body("hand").xmat.reshape(3, 3)
        pose[:3, 3] = data.body("hand").xpos
        return pose

    mug, q, found = lying(seed), PANDA.q_home, []
    for toggle in Toggle:
        held = toggle in (Toggle.RELEASE1, Toggle.RELEASE2)
        keyframes = expert.keyframes(mug, q, held).q
        pose = np.linalg.inv(hand(q)) @ mug if held else mug
        for k, q_goal in enumerate(keyframes):
            found.append(Problem(toggle, len(keyframes) - k, q, q_goal, pose, held))
            q = q_goal
        mug = hand(q) @ pose if held else mug
    return found


@pytest.fixture(scope="module")
def phases():
    model = scene.build("physics")
    return [p for seed in range(100_000, 100_006) for p in problems(model, seed)]


def world_of(planning: Scene, problem: Problem) -> World:
    """The world of a phase near a toggle, whose contacts are allowed throughout."""
    return make_world(
        planning,
        object_pose=from_matrix(problem.mug)[None],
        held=np.array([problem.held]),
        passive=np.full(2, 0.003 if problem.held else 0.04),
        ignored=allowed_contacts()["held" if problem.held else "free", True],
    )


def blocked(variant: str, phases: list[Problem]) -> np.ndarray:
    """Of which phases C MuJoCo refuses the straight line."""
    planning = Scene.from_mjcf(scene.build("planning", variant=variant))
    return np.array(
        [
            not certify(
                planning, world_of(planning, p), np.stack([p.q_start, p.q_goal])
            ).valid
            for p in phases
        ]
    )


def test_straight_lines_of_long_phases_are_blocked(phases):
    """In at least 4 of 5 long phases, against none in the plain scene; short ones are free."""
    long = np.array([(p.toggle, p.left) in LONG for p in phases])
    cluttered, plain = blocked("cluttered", phases), blocked("plain", phases)
    assert not plain.any()
    assert cluttered[long].mean() >= 0.8
    assert not cluttered[~long].any()


def test_keyframes_keep_away_from_obstacles(phases):
    """By at least 2 cm, more than noisy demonstrations and tracking take."""
    model = scene.build("planning", variant="cluttered")
    data = mujoco.MjData(model)
    names = [model.geom(g).name for g in range(model.ngeom)]
    clutter = np.flatnonzero(model.geom_bodyid == model.body("clutter").id)
    clutter = [g for g in clutter if names[g].endswith("_planning")]
    hand = model.body("hand").id
    for p in phases:
        data.qpos[:7] = p.q_goal
        mujoco.mj_kinematics(model, data)
        pose = np.eye(4)
        pose[:3, :3] = data.xmat[hand].reshape(3, 3)
        pose[:3, 3] = data.xpos[hand]
        data.qpos[9:16] = from_matrix(pose @ p.mug if p.held else p.mug)
        mujoco.mj_kinematics(model, data)
        for box in clutter:
            moving = np.flatnonzero(model.geom_contype & (4 | 8))
            inside = (data.geom_xpos[moving] - data.geom_xpos[box]) @ data.geom_xmat[
                box
            ].reshape(3, 3)
            outside = np.maximum(np.abs(inside) - model.geom_size[box], 0)
            gap = np.linalg.norm(outside, axis=1) - model.geom_size[moving, 0]
            moves = model.body_weldid[model.geom_bodyid[moving]] != 0
            assert gap[moves].min() > 0.02, (names[box], p.toggle, p.left)


def test_no_obstacle_hides_the_mug(phases):
    """At home and at the transits the hand's camera sees the mug's ends past the obstacles."""
    model = scene.build("physics", variant="cluttered")
    data, geom = mujoco.MjData(model), np.zeros(1, np.int32)
    group = np.array([0, 0, 1, 0, 0, 0], np.uint8)
    clutter = model.body("clutter").id
    for p in phases:
        if p.held or p.left < 2:
            continue
        data.qpos[:7] = p.q_start
        data.qpos[9:16] = from_matrix(p.mug)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        eye = data.camera("hand").xpos
        for z in (-SHAPE.height / 2, 0, SHAPE.height / 2):
            ray = p.mug[:3, :3] @ [0, 0, z] + p.mug[:3, 3] - eye
            mujoco.mj_ray(model, data, eye, ray, group, 1, -1, geom, None)
            assert model.geom_bodyid[geom[0]] != clutter


def test_the_networks_are_shown_the_same_shapes(mug_task):
    task = MugTask(1, variant="cluttered")
    task.reset([0], [0])
    mug_task.reset([0], [0])
    mine, plain = (jax.tree.leaves(t.observe([0])) for t in (task, mug_task))
    for leaf, other in zip(mine, plain, strict=True):
        assert leaf.shape[1:] == other.shape[1:]
        assert leaf.dtype == other.dtype
    np.testing.assert_array_equal(task.object_pose(0), mug_task.object_pose(0))


def test_the_expert_solves_it_and_mujoco_agrees():
    task = MugTask(2, variant="cluttered")
    expert = ExpertAgent(task)
    certification = Certification(expert.planner, task.planning_scene)
    records = run_episodes(task, expert, range(2), listeners=[certification])
    assert [record.failure for record in records] == [None, None]
    assert certification.refused == []
    assert certification.invalid == []


def test_an_unknown_variant_is_refused():
    with pytest.raises(ValueError, match="variant 'shelf': plain or cluttered"):
        scene.build("physics", variant="shelf")

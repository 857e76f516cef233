"""Random scenes, whole questions; `eval/fuzz.py` asks many more of them."""

import mujoco
import numpy as np
import pytest

from jaxplan import collision
from jaxplan.collision import World, make_world
from jaxplan.collision.oracle import Replica
from jaxplan.collision.touching import random_poses
from jaxplan.evaluation.fuzzing import interrogate
from jaxplan.evaluation.random_scenes import KINDS, random_scene, random_world

SMALL = 4
"""Joints at most of the scenes that are asked: compilation is what takes long."""
ASKED = [*range(3), *(pytest.param(n, marks=pytest.mark.slow) for n in range(3, 12))]
DRAWN = range(40)


@pytest.fixture
def quick(monkeypatch):
    """Compiled programs run seldom here."""
    level = "xla_backend_optimization_level"
    monkeypatch.setitem(collision.XLA_OPTIONS, level, 0)


@pytest.mark.parametrize("seed", ASKED)
@pytest.mark.usefixtures("quick")
@pytest.mark.long
def test_whole_questions_have_right_answers(seed: int):
    scene = random_scene(seed, SMALL).read()
    world = random_world(scene, np.random.default_rng(seed))
    judged = interrogate(scene, seed, [world])
    assert not judged.faults
    assert judged.counts["configurations"] == 200


def test_all_that_there_is_is_drawn():
    scenes = [random_scene(seed).read() for seed in DRAWN]
    robots, slots = set(), set()
    for scene in scenes:
        robots |= {side.kind for g in scene.groups for side in g.contacts[0]}
        slots |= {slot.kind for slot in scene.slots}
    assert robots == {*KINDS, "plane"}
    assert slots == {*KINDS} - {"mesh"}
    for name in ("objects", "mocap", "passive", "dependent", "excluded"):
        assert any(getattr(scene, name) for scene in scenes), name
    counts = {len(scene.joints) for scene in scenes}
    assert min(counts) == 1
    assert max(counts) > 10
    kinds = {scene.joint_kind(name) for scene in scenes for name in scene.joints}
    assert kinds == {"hinge", "slide"}
    assert any(scene.circular.any() for scene in scenes)
    margins = [scene.mj_model.geom_margin.max(initial=0) for scene in scenes]
    assert min(margins) == 0 < max(margins)


@pytest.mark.parametrize("seed", range(12))
def test_contacts_are_those_of_the_model_that_was_read(seed: int):
    """By nothing but MuJoCo: its filter, its kinematics, and the polynomials."""
    scene = random_scene(seed).read()
    model, replica = scene.mj_model, Replica(scene)
    data, q = mujoco.MjData(model), random_poses(scene, 20, seed).astype(float)
    replica.load(World(*map(np.asarray, make_world(scene))), q)  # pyright: ignore
    slots = {slot.geom for slot in scene.slots}
    objects = {scene.body_id(name) for name in scene.objects}
    address, zero = model.jnt_qposadr, model.qpos0
    moving = {*scene.structure.moved, *objects}
    for row, values in enumerate(q):
        data.qpos[:] = zero
        data.qpos[scene.addresses(scene.joints)] = values
        for e in range(model.neq):
            joint, master = address[[model.eq_obj1id[e], model.eq_obj2id[e]]]
            moved = np.polyval(
                model.eq_data[e, 4::-1], data.qpos[master] - zero[master]
            )
            data.qpos[joint] = zero[joint] + moved
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        replica.pose(row)
        np.testing.assert_allclose(replica.data.xpos, data.xpos, atol=1e-6)
        expected = set()
        for pair in _deep(data.contact.geom, data.contact.dist, slots):
            above = [
                moving & {*scene.line(int(model.geom_bodyid[geom]))} for geom in pair
            ]
            # What lies on the world or on another thing counts when it is held.
            counts = above[0] != above[1] and not all(s <= objects for s in above)
            if counts and pair not in scene.structure.excludes.geoms:
                expected.add(pair)
        distance, geoms = replica.contacts(0.0)
        assert _deep(geoms, distance, slots) == expected


def _deep(geoms, distance, slots: set[int]) -> set[tuple[int, int]]:
    """Pairs that penetrate, without the slots'."""
    pairs = {(int(min(g)), int(max(g))) for g in geoms[distance < -1e-6]}
    return {pair for pair in pairs if not slots & {*pair}}

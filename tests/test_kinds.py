"""All kinds of robots among all kinds of obstacles, in the model and in slots."""

import os
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import NamedTuple

import jax
import mujoco
import numpy as np
import pytest
from quick import jit

import jaxplan
from jaxplan.collision import (
    Obstacle,
    World,
    clearance,
    clearance_mujoco,
    config_free,
    make_world,
)
from jaxplan.scene import Scene

SIZES = {
    "sphere": [0.06],
    "capsule": [0.04, 0.09],
    "ellipsoid": [0.05, 0.07, 0.1],
    "cylinder": [0.06, 0.08],
    "box": [0.05, 0.06, 0.09],
    "mesh": [],
}
ROBOT = tuple(SIZES)
WORLD = (*ROBOT, "plane")
SLOTS = ROBOT[:-1]
PLACES = (0.4, 0.1), (0.2, 0.4), (-0.25, 0.35), (-0.4, -0.05), (-0.2, -0.4), (0.3, -0.3)
POSES = {
    kind: [x, y, 0.05 * (i % 3), 1.0, 0.2 * i, 0.3, 0.1]
    for i, (kind, (x, y)) in enumerate(zip(ROBOT, PLACES, strict=True))
}
"""Obstacles around an arm that stands in the origin."""
TOLERANCE = 1e-4


class Case(NamedTuple):
    """One scene."""

    robot: tuple[str, ...]
    world: tuple[str, ...]
    slots: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        return " ".join("+".join(kinds) or "-" for kinds in self)


def add(body: mujoco.MjsBody, kind: str, pose: list[float]) -> None:
    """A geom of some kind; a mesh is a wedge."""
    geom = body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"))
    geom.size[: len(SIZES.get(kind, []))] = SIZES.get(kind, [])
    geom.pos, geom.quat = pose[:3], pose[3:]
    if kind == "mesh":
        geom.meshname = "wedge"
    if kind == "plane":
        geom.size, geom.pos = [1, 1, 1], [0, 0, -0.25]


def build(case: Case) -> tuple[Scene, World]:
    """An arm of a rail and two hinges; each of its kinds on both of its links."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    corners = np.array([[-1, -1, -1], [1, -1, -1], [-1, 1, -1], [0, 0, 1]]) * 0.09
    spec.add_mesh(name="wedge", uservert=corners.ravel())
    for kind in case.world:
        add(spec.worldbody, kind, POSES.get(kind, [0, 0, 0, 1, 0.1, 0.05, 0]))
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    base = spec.worldbody.add_body(name="base")
    base.add_joint(name="rail", type=slide, axis=[0, 0, 1], range=[-0.2, 0.2])
    base.add_joint(name="turn", type=hinge, axis=[0, 0.1, 1], range=[-3, 3])
    arm = base.add_body(name="arm", pos=[0.25, 0, 0.05])
    arm.add_joint(name="bend", type=hinge, axis=[1, 1, 0], range=[-2, 2])
    for i, kind in enumerate(case.robot):
        for body in (base, arm):
            add(body, kind, [0.05, 0.04 * (i - 2), 0.0, 1, 0.1 * i, 0.2, 0.0])
    slots = dict.fromkeys(case.slots, 1)
    scene = Scene.from_mjcf(spec, slots=slots)
    obstacles = [Obstacle(kind, SIZES[kind], POSES[kind]) for kind in case.slots]
    return scene, make_world(scene, obstacles=obstacles)


TOGETHER = Case(ROBOT, WORLD, SLOTS)
ALONE = [
    *(Case((a,), (b,)) for a, b in product(ROBOT, WORLD)),
    *(Case((a,), (), (b,)) for a, b in product(ROBOT, SLOTS)),
    *(Case((a,), ("mesh",), (b,)) for a, b in product(ROBOT, SLOTS)),
]
SMALL = [
    Case(("box",), (), ("sphere",)),
    Case(("sphere",), (), ("ellipsoid",)),
    Case(("capsule",), ("mesh",), ("cylinder",)),
]


@pytest.mark.parametrize("case", ALONE, ids=lambda case: case.name)
def test_every_pair_of_kinds_can_be_asked(case: Case):
    """Tracing finds what does not fit together; the numbers are the next test's."""
    scene, world = build(case)
    answer = jax.eval_shape(clearance, scene, world, np.zeros((5, 3), np.float32))
    assert (answer.shape, answer.dtype) == ((5,), np.float32)


def near(scene: Scene, world: World, rows: int) -> np.ndarray:
    """Random configurations, many of them close to contact."""
    rng = np.random.default_rng(0)
    return rng.uniform(scene.q_min, scene.q_max, (rows, 3)).astype(np.float32)


@pytest.mark.parametrize("case", [TOGETHER, *SMALL], ids=lambda case: case.name)
def test_all_kinds_agree_with_mujoco(case: Case):
    scene, world = build(case)
    q = near(scene, world, 300)

    def ask(q: jax.Array):
        return clearance(scene, world, q), config_free(scene, world, q, 0.01)

    distance, free = map(np.asarray, jit(ask)(q))
    expected = clearance_mujoco(scene, world, q, reach=0.05)
    apart = expected > 0
    assert 0 < apart.mean() < 1
    clear = np.abs(expected) > TOLERANCE
    np.testing.assert_array_equal((distance > 0)[clear], apart[clear])
    seen = apart & np.isfinite(expected)
    np.testing.assert_allclose(distance[seen], expected[seen], atol=TOLERANCE)
    assert (distance[~np.isfinite(expected)] > 0.05 - TOLERANCE).all()
    clear = np.abs(distance - 0.01) > TOLERANCE
    np.testing.assert_array_equal(free[clear], (distance > 0.01)[clear])


def test_a_geom_of_explicit_pairs_meets_every_slot():
    """Each slot is then a contact of its own."""
    scene = Scene.from_mjcf(
        """<mujoco><worldbody><geom name="post" size=".1" pos="0 0 -.3"/>
        <body><joint name="j" type="slide" axis="1 0 0" range="-1 1"/>
          <geom name="g" size=".1" contype="0" conaffinity="0"/></body>
        </worldbody><contact><pair geom1="post" geom2="g"/></contact></mujoco>""",
        slots={"box": 2},
    )
    boxes = [Obstacle("box", [0.1, 0.1, 0.1], [x, 0, 0]) for x in (-0.6, 0.9)]
    world = make_world(scene, obstacles=boxes)
    q = np.array([[-0.3], [0.0], [0.5]], np.float32)
    ask = jit(clearance)
    np.testing.assert_allclose(ask(scene, world, q), [0.1, 0.1, 0.2], atol=1e-6)


@pytest.mark.long
def test_the_planner_answers_whole_questions():
    scene, world = build(Case(("box",), (), ("capsule",)))
    planner = jaxplan.Planner(scene)
    rng = np.random.default_rng(1)
    q = rng.uniform(scene.q_min, scene.q_max, (200, 3))
    q = q[planner.clearance(q, world) > 0.01][:4]
    plans = [planner.plan(q[0], q[1], world=world)]
    plans += planner.plan_batch(q[:2], q[2:], worlds=world)
    assert any(plan.solved for plan in plans)
    for plan in plans:
        if plan.solved:
            assert planner.certify(plan).valid
            assert planner.time(plan).free


WIDE = """
import jax, numpy as np
from quick import jit
from test_kinds import SMALL, TOGETHER, build, clearance, config_free, near
scene, world = build(TOGETHER)
q = near(scene, world, 4)
assert q.dtype == np.float32 and scene.model.geom_pos.dtype == np.float64
for rows in (q, q.astype(float)):
    assert jax.eval_shape(clearance, scene, world, rows).dtype == np.float32
for motion in (None, 0.1 + 0.0 * q):
    free = jax.eval_shape(config_free, scene, world, q, 0.01, motion=motion)
    assert free.dtype == bool
scene, world = build(SMALL[0])
ask = jit(clearance)
assert np.isfinite(ask(scene, world, near(scene, world, 4))).all()
"""


def test_the_engine_works_in_float32_where_jax_is_set_to_64_bits():
    here = Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parent), *sys.path])
    environment = {**os.environ, "JAX_ENABLE_X64": "1", "PYTHONPATH": path}
    subprocess.run([sys.executable, "-c", WIDE], env=environment, check=True)

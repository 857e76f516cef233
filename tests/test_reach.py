"""Bounds on motion: never too small, wherever the arm is, and not much too large."""

from typing import NamedTuple

import jax
import mujoco
import numpy as np
import pytest
from quick import jit

from jaxplan.collision import (
    Obstacle,
    World,
    clearance,
    clearance_mujoco,
    config_free,
    make_world,
    motion_bound,
    pair_motion_bounds,
)
from jaxplan.collision.positions import carry, qpos_rows
from jaxplan.scene import Scene, geom_pairs

HINGE, SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
ROWS = 400
BAND = 1e-5
ask = jit(config_free, static_argnums=4)
distance = jit(clearance, static_argnums=3)
most = jit(motion_bound)
ALL = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")


def add_geoms(
    body: mujoco.MjsBody, kinds, rng: np.random.Generator, far: float
) -> None:
    for kind in kinds:
        geom = body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}"))
        geom.size = rng.uniform(0.01, 0.04, 3)
        geom.pos, geom.quat = rng.uniform(-far, far, 3), rng.normal(size=4)
        if kind == "mesh":
            geom.meshname = "hull"


def add_joints(
    body: mujoco.MjsBody, names: list[str], rng: np.random.Generator
) -> None:
    """One to three of them, hinges and slides, not in the body's origin."""
    for _ in range(rng.integers(1, 4)):
        slides = rng.random() < 0.3
        most = 0.2 if slides else rng.uniform(0.5, 3)
        limits = sorted(rng.uniform(-most, most, 2))
        joint = body.add_joint(name=f"j{len(names)}", axis=rng.normal(size=3))
        joint.type, joint.pos = SLIDE if slides else HINGE, rng.uniform(-0.1, 0.1, 3)
        joint.ref = rng.uniform(*limits)
        if slides or rng.random() < 0.7:
            joint.range = limits
        names.append(joint.name)


def random_scene(seed: int, kinds) -> Scene:
    """A tree with a branch, a finger, a thing that can be held, slots, obstacles."""
    rng, spec, names = np.random.default_rng(seed), mujoco.MjSpec(), []
    spec.compiler.degree = False
    spec.add_mesh(name="hull", uservert=rng.uniform(-0.06, 0.06, (5, 3)).ravel())
    add_geoms(spec.worldbody, kinds, rng, 0.7)
    bodies = [spec.worldbody]
    for above in (0, 1, 2, 1):
        body = bodies[above].add_body(name=f"b{len(bodies)}")
        body.pos, body.quat = rng.uniform(-0.2, 0.2, 3), rng.normal(size=4)
        add_joints(body, names, rng)
        add_geoms(body, rng.choice(kinds, 2), rng, 0.1)
        bodies.append(body)
    follower = bodies[2].add_body(name="follower", pos=[0, 0.1, 0.1])
    follower.add_joint(name="d", axis=[1, 0, 1])
    add_geoms(follower, rng.choice(kinds, 1), rng, 0.1)
    drive = spec.add_equality(name1="d", name2="j0", objtype=mujoco.mjtObj.mjOBJ_JOINT)
    drive.type = mujoco.mjtEq.mjEQ_JOINT
    drive.data[:5] = [0.3, -0.8, 0.4, 0.1, -0.1]
    if seed % 2:  # without limits the curve has no steepest place
        spec.joint("j0").type, spec.joint("j0").range = HINGE, (0, 0)
        spec.joint("d").type = SLIDE
    finger = bodies[3].add_body(name="finger", pos=[0, 0, 0.1])
    finger.add_joint(name="f", type=SLIDE, axis=[1, 0, 0], range=[0, 0.05])
    add_geoms(finger, rng.choice(kinds, 1), rng, 0.05)
    thing = spec.worldbody.add_body(name="thing", pos=[0.3, 0.3, 0.3])
    thing.add_freejoint()
    add_geoms(thing, rng.choice(kinds, 2), rng, 0.05)
    slots = {"sphere": 1, "capsule": 1}
    return Scene.from_mjcf(spec, joints=names, hand="b3", slots=slots)


class Case(NamedTuple):
    scene: Scene
    world: World
    """Leaves `[ROWS, ...]`: in half of them the thing is held."""
    q: np.ndarray


def case(seed: int, kinds) -> Case:
    scene, rng = random_scene(seed, kinds), np.random.default_rng(seed)
    pose = np.concatenate(
        [rng.uniform(-0.2, 0.2, (ROWS, 1, 3)), rng.normal(size=(ROWS, 1, 4))], -1
    )
    world = make_world(
        scene,
        object_pose=pose,
        held=rng.random((ROWS, 1)) < 0.5,
        passive=rng.uniform(0, 0.05, (ROWS, 1)),
        obstacles=[
            Obstacle("sphere", [0.05], [0.3, 0, 0.2]),
            Obstacle("capsule", [0.05, 0.1], [-0.3, 0.2, 0]),
        ],
    )
    low, high = np.clip([scene.q_min, scene.q_max], -3, 3)
    return Case(scene, world, rng.uniform(low, high, (ROWS, len(low))))


CASES = [(seed, ("sphere", "capsule")) for seed in range(2)] + [(2, ALL)]


@pytest.fixture(scope="module", params=CASES, ids=lambda p: f"{p[0]}-{len(p[1])}")
def drawn(request) -> Case:
    return case(*request.param)


def row(world: World, scene: Scene, index: int) -> World:
    """The world of one row."""
    empty = make_world(scene)
    pairs = zip(world, empty, strict=True)
    return World(*(x[index] if x.ndim > own.ndim else x for x, own in pairs))


def limits(scene: Scene) -> tuple[jax.Array, jax.Array]:
    """Of a traced scene with a joint that follows, they could not be read."""
    return scene.q_min, scene.q_max


def motions(drawn: Case) -> np.ndarray:
    """`[ROWS, d]` small and large ones, some joints at rest."""
    rng, shape = np.random.default_rng(0), drawn.q.shape
    sizes = 10 ** rng.uniform(-3, -0.5, (ROWS, 1)) * rng.uniform(0, 1, shape)
    return sizes * (rng.random(shape) < 0.7)


def test_what_is_proven_is_true_of_all_that_is_near(drawn: Case):
    scene, world, q = drawn
    rng, motion = np.random.default_rng(1), motions(drawn)
    proven = {
        m: np.asarray(ask(scene, world, q, m, "fast", motion)) for m in (0.0, 0.02)
    }
    assert 0.05 < proven[0].mean() < 0.95
    for i in range(16):
        # Inside, and at the corners.
        share = rng.uniform(-1, 1, q.shape) if i % 2 else rng.choice([-1, 1], q.shape)
        near = q + share * motion
        for margin, true in proven.items():
            free = np.asarray(ask(scene, world, near, margin - BAND, "fast", 0 * q))
            assert free[true].all()
        if not i:
            oracle = clearance_mujoco(scene, world, near)
            for margin, true in proven.items():
                assert (oracle[true] > margin - 1e-4).all()


@pytest.mark.parametrize("drawn", CASES[:2], indirect=True, ids=str)
def test_what_is_far_for_its_motion_is_proven(drawn: Case):
    scene, world, q = drawn
    least, motion = np.asarray(distance(scene, world, q)), motions(drawn)
    # From a configuration on, what one joint moves is further out for the others.
    bound = np.asarray(most(scene, world, motion, *limits(scene)))
    bound = bound * np.exp(motion.sum(-1))
    far = least > bound + BAND
    assert far.mean() > 0.01
    assert np.asarray(ask(scene, world, q, 0.0, "fast", motion))[far].all()
    lower = np.asarray(distance(scene, world, q, "fast", motion))
    for margin in (0.0, 0.02):
        proven = np.asarray(ask(scene, world, q, margin, "fast", motion))
        clear = np.abs(lower - margin) > BAND
        np.testing.assert_array_equal(proven[clear], (lower > margin)[clear])
        still = np.asarray(ask(scene, world, q, margin, "fast", 0 * q))
        clear = np.abs(least - margin) > BAND
        np.testing.assert_array_equal(still[clear], (least > margin)[clear])
    lost = np.where(np.arange(ROWS)[:, None] % 2, np.nan, 0 * q)
    assert not np.asarray(ask(scene, world, q, 0.0, "fast", lost))[1::2].any()


def core_points(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """`[n, 3]` of a geom without what is round around it, in its frame."""
    kind, size = (
        mujoco.mjtGeom(model.geom_type[geom]).name[7:].lower(),
        model.geom_size[geom],
    )
    around = np.random.default_rng(geom).normal(size=(20, 3))
    around /= np.linalg.norm(around, axis=-1, keepdims=True)
    if kind == "sphere":
        return np.zeros((1, 3))
    if kind == "capsule":
        return np.array([[0, 0, -size[1]], [0, 0, size[1]]])
    if kind == "cylinder":
        rim = around[:, :2] / np.linalg.norm(around[:, :2], axis=-1, keepdims=True)
        return np.c_[size[0] * rim, size[1] * np.sign(around[:, 2])]
    if kind == "mesh":
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return model.mesh_vert[start : start + count]
    return size * (np.sign(around) if kind == "box" else around)


def placed(scene: Scene, world: World, q: np.ndarray) -> list[np.ndarray]:
    """Core points of all geoms in the world, by C MuJoCo."""
    model = scene.mj_model
    data = mujoco.MjData(model)
    one = World(*(np.asarray(leaf)[None] for leaf in world))
    data.qpos[:] = qpos_rows(scene, one, q[None])[0]
    mujoco.mj_kinematics(model, data)
    carry(scene, data, np.asarray(world.held))
    mujoco.mj_kinematics(model, data)
    return [
        core_points(model, g) @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
        for g in range(model.ngeom)
    ]


def test_no_geom_moves_further_than_its_bound(drawn: Case):
    scene, world, q = drawn
    rng = np.random.default_rng(1)
    for index in range(30):
        own = row(world, scene, index)
        start = q[index]
        end = q[index - 1] if index % 2 else start + rng.normal(size=start.shape) * 0.05
        bounds = pair_motion_bounds(scene, own, end - start)
        before, after = (placed(scene, own, x) for x in (start, end))
        greatest = 0.0
        for group in scene.groups:
            if group.held and not np.asarray(own.held)[list(group.held)].any():
                continue
            for i, j in (p for contact in group.contacts for p in geom_pairs(contact)):
                gaps = [
                    np.linalg.norm(x[i][:, None] - x[j][None], axis=-1)
                    for x in (before, after)
                ]
                assert np.abs(gaps[1] - gaps[0]).max() <= bounds[i, j] + 1e-6
                greatest = max(greatest, bounds[i, j])
        # Over the geoms of a body together it is a little greater.
        all_pairs = float(most(scene, own, end - start, *limits(scene)))
        assert (1 - 1e-5) * greatest - 1e-6 <= all_pairs <= 1.2 * greatest + 1e-6


ONE = """<mujoco><compiler angle="radian"/><worldbody>
  <geom name="post" size=".1" pos="0 0 3"/>
  <body name="base"><joint name="j" axis="0 0 1" pos="0 0 .2"/>
    <geom name="tip" size=".05" pos=".3 .4 .7"/>
    <body name="sled" pos=".3 .4 0"><joint name="s" type="slide" axis="1 0 0" range="-.1 .3"/>
      <geom name="ball" size=".05"/></body></body>
</worldbody>
<contact><exclude body1="base" body2="sled"/></contact></mujoco>"""


def test_one_hinge_and_one_sphere_have_the_closed_form():
    scene = Scene.from_mjcf(ONE)
    world = make_world(scene)
    names = [scene.mj_model.geom(n).id for n in ("tip", "ball", "post")]
    tip, ball, post = names
    turn = pair_motion_bounds(scene, world, [0.1, 0.0])
    np.testing.assert_allclose(turn[tip, post], 0.1 * 0.5, atol=1e-6)
    # The slide stands in the middle of its 0.4 m, at x = 0.4, and half of them away.
    np.testing.assert_allclose(
        turn[ball, post], 0.1 * (np.hypot(0.4, 0.4) + 0.2), atol=1e-6
    )
    both = pair_motion_bounds(scene, world, [[0.0, 0.1], [0.1, 0.1]])
    np.testing.assert_allclose(
        both[:, ball, post], [0.1, 0.1 + turn[ball, post]], atol=1e-6
    )
    np.testing.assert_allclose(
        motion_bound(scene, world, np.array([0.1, 0.1])), both.max()
    )
    assert (turn == turn.T).all()
    # From a configuration the hinge sees the slide where it is: at x = 0.2.
    q = np.array([0.2, -0.1], np.float32)
    for other, motion, moved in (
        ("sled", [0.1, 0.0], 0.1 * 0.5),
        ("sled", [0.0, 0.1], 0.0),
        ("base", [0.1, 0.0], 0.1 * np.hypot(0.2, 0.4)),
        ("base", [0.1, 0.05], 0.05 + 0.1 * (np.hypot(0.2, 0.4) + 0.05)),
    ):
        own = make_world(scene, ignored=[f"{other}|world"])
        least = float(distance(scene, own, q)) - moved
        h = np.array(motion, np.float32)
        assert ask(scene, own, q, least - 1e-5, "fast", h)
        assert not ask(scene, own, q, least + 1e-5, "fast", h)


STRETCHED = """<mujoco><compiler angle="radian"/><worldbody>
  <geom name="post" size=".1" pos="0 3 0"/>
  <body name="upper"><joint name="j" axis="0 0 1"/>
    <geom size=".02" contype="0" conaffinity="0"/>
    <body name="fore" pos=".5 0 0"><joint name="k" axis="0 0 1" pos=".1 0 0"/>
      <geom name="rod" type="capsule" size=".02 .1" pos=".4 0 0" quat="1 0 1 0"/></body></body>
</worldbody></mujoco>"""


def test_a_stretched_arm_has_the_closed_form():
    scene = Scene.from_mjcf(STRETCHED)
    world, q = make_world(scene), np.zeros(2, np.float32)
    rod, post = (scene.mj_model.geom(n).id for n in ("rod", "post"))
    least = float(distance(scene, world, q))
    for motion, moved in (
        ([0.1, 0.0], 0.1 * 1.0),
        ([0.0, 0.1], 0.1 * 0.4),
        ([0.1, 0.1], 0.1 * 1.4),
    ):
        bounds = pair_motion_bounds(scene, world, motion)
        np.testing.assert_allclose(bounds[rod, post], moved, atol=1e-6)
        h = np.array(motion, np.float32)
        assert ask(scene, world, q, least - moved - 1e-5, "fast", h)
        assert not ask(scene, world, q, least - moved + 1e-5, "fast", h)


def test_held_things_hang_on_the_hand():
    scene = Scene.from_mjcf(
        """<mujoco><worldbody><geom name="post" size=".1" pos="0 3 0"/>
        <body name="arm"><joint name="j" axis="0 0 1"/><geom name="g" size=".05"/></body>
        <body name="thing"><freejoint/><geom name="t" size=".05"/></body>
        </worldbody></mujoco>"""
    )
    t, post, g = (scene.mj_model.geom(n).id for n in ("t", "post", "g"))
    held = make_world(scene, [[0.7, 0, 0, 1, 0, 0, 0]], [True])
    bounds = pair_motion_bounds(scene, held, [0.1])
    np.testing.assert_allclose([bounds[t, post], bounds[t, g]], [0.07, 0], atol=1e-6)
    free = pair_motion_bounds(scene, held._replace(held=~held.held), [0.1])
    np.testing.assert_allclose(free[t, post], 0, atol=1e-6)


def test_the_reference_backend_takes_off_the_table():
    scene = Scene.from_mjcf(STRETCHED)
    world, q = make_world(scene), np.linspace(-3, 3, 60).reshape(30, 2)
    motion = np.full((30, 2), 0.1)
    least = np.asarray(distance(scene, world, q))
    bound = np.asarray(most(scene, world, motion))
    for margin in (float(np.median(least - bound)), 0.0):
        proven = np.asarray(ask(scene, world, q, margin, "mjx", motion))
        clear = np.abs(least - bound - margin) > 1e-4
        np.testing.assert_array_equal(proven[clear], (least - bound > margin)[clear])

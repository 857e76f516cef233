"""The fast backend against C MuJoCo, `mjx.collision` and its own laws."""

import copy

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from mug_worlds import random_world

from jaxplan import cli
from jaxplan.collision import (
    XLA_OPTIONS,
    World,
    clearance,
    clearance_mujoco,
    config_free,
    make_world,
    motion_free,
    required_clearances,
    tightest_pair,
)
from jaxplan.motion import Planner
from jaxplan.planning import points_for
from jaxplan.robots import PANDA
from jaxplan.scene import Scene
from jaxplan.tasks.mug.scene import build

BAND = 1e-3


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(build("planning"))


fast_clearance = jax.jit(clearance, compiler_options=XLA_OPTIONS)
fast_free = jax.jit(config_free, static_argnums=4, compiler_options=XLA_OPTIONS)


def uniform(scene: Scene, rng: np.random.Generator, rows: int) -> np.ndarray:
    return rng.uniform(scene.q_min, scene.q_max, (rows, len(scene.joints)))


def near_contact(scene: Scene, rng: np.random.Generator, rows: int):
    """Configurations within some millimetres of contact, by bisection on lines."""
    world = random_world(scene, rng, rows)
    free, hit = (uniform(scene, rng, rows) for _ in range(2))
    sign = [np.asarray(fast_clearance(scene, world, q)) for q in (free, hit)]
    mixed = (sign[0] > 0) != (sign[1] > 0)
    swap = (sign[0] <= 0)[:, None]
    free, hit = np.where(swap, hit, free), np.where(swap, free, hit)
    for _ in range(12):
        middle = (free + hit) / 2
        safe = (np.asarray(fast_clearance(scene, world, middle)) > 0)[:, None]
        free, hit = np.where(safe, middle, free), np.where(safe, hit, middle)
    q = free + rng.normal(size=free.shape) * 0.01
    return World(*(leaf[mixed] for leaf in world)), q[mixed]


def assert_agrees(scene: Scene, world: World, q: np.ndarray) -> None:
    """Same verdict outside of the band; same distance as far as C MuJoCo looks."""
    expected = clearance_mujoco(scene, world, q, reach=0.02)
    q = q.astype(np.float32)
    distance = np.asarray(fast_clearance(scene, world, q))
    free = np.asarray(fast_free(scene, world, q))
    clear = np.abs(expected) > BAND
    np.testing.assert_array_equal(free[clear], expected[clear] > 0)
    np.testing.assert_array_equal(free, distance > 0)
    reached = np.isfinite(expected)
    np.testing.assert_allclose(distance[reached], expected[reached], atol=1e-5)
    assert (distance[~reached] > 0.02 - 1e-5).all()


def test_random_configurations_agree_with_mujoco(scene: Scene):
    rng = np.random.default_rng(0)
    assert_agrees(scene, random_world(scene, rng, 10_000), uniform(scene, rng, 10_000))


def test_near_contact_configurations_agree_with_mujoco(scene: Scene):
    rng = np.random.default_rng(1)
    world, q = near_contact(scene, rng, 6_000)
    assert len(q) >= 2_000
    distance = np.asarray(fast_clearance(scene, world, q))
    assert np.median(np.abs(distance)) < 0.01
    assert_agrees(scene, world, q)


@pytest.mark.slow
def test_hundred_thousand_configurations_agree_with_mujoco(scene: Scene):
    rng = np.random.default_rng(2)
    for _ in range(10):
        rows = 10_000
        assert_agrees(scene, random_world(scene, rng, rows), uniform(scene, rng, rows))
    world, q = near_contact(scene, rng, 30_000)
    assert len(q) >= 10_000
    assert_agrees(scene, world, q)


def test_margin_is_subtracted_from_clearance(scene: Scene):
    rng = np.random.default_rng(3)
    world, q = random_world(scene, rng, 512), uniform(scene, rng, 512)
    distance = np.asarray(fast_clearance(scene, world, q))
    for margin in (0.005, 0.03):
        free = np.asarray(fast_free(scene, world, q, margin))
        clear = np.abs(distance - margin) > 1e-5
        np.testing.assert_array_equal(free[clear], (distance > margin)[clear])


def test_a_batch_of_worlds_equals_a_loop(scene: Scene):
    rng = np.random.default_rng(4)
    worlds, q = random_world(scene, rng, 6), uniform(scene, rng, 5)
    grid = World(*(jnp.expand_dims(leaf, 1) for leaf in worlds))
    together = fast_clearance(scene, grid, q)
    assert together.shape == (6, 5)
    for i in range(6):
        one = World(*(leaf[i] for leaf in worlds))
        np.testing.assert_allclose(
            fast_clearance(scene, one, q), together[i], atol=2e-6
        )
    shared = worlds._replace(passive=jnp.zeros(2), ignored=jnp.zeros_like(one.ignored))
    assert fast_clearance(scene, shared, q[0]).shape == (6,)


def test_what_is_not_finite_is_not_free(scene: Scene):
    world, q = make_world(scene), np.tile(PANDA.q_home, (4, 1))
    q[1, 2], q[2, 6] = np.nan, np.inf
    assert fast_free(scene, world, q).tolist() == [True, False, False, True]
    assert np.isnan(fast_clearance(scene, world, q)).tolist() == [0, 1, 1, 0]
    lost = world._replace(object_pose=world.object_pose * jnp.nan)
    assert not fast_free(scene, lost, q).any()


def test_home_is_free_and_ignored_groups_do_not_count(scene: Scene):
    world = make_world(scene)
    assert fast_clearance(scene, world, PANDA.q_home) > 0.02
    around = world._replace(object_pose=_mug_around_finger())
    held = around._replace(held=jnp.ones(1, bool))
    assert fast_clearance(scene, held, PANDA.q_home) < 0
    names = ["left_finger|mug", "mug|right_finger", "hand|mug"]
    allowed = held._replace(ignored=scene.ignored(names))
    assert fast_clearance(scene, allowed, PANDA.q_home) > 0


def _mug_around_finger() -> jnp.ndarray:
    return jnp.array([[0, 0.04, 0.14, 1, 0, 0, 0.0]])


def test_motion_checks_every_point_but_the_start(scene: Scene):
    rng = np.random.default_rng(5)
    world = random_world(scene, rng, 64)
    q0 = uniform(scene, rng, 64)
    q1 = q0 + rng.normal(size=q0.shape) * 0.2
    motion = jax.jit(motion_free, static_argnums=4, compiler_options=XLA_OPTIONS)
    free = motion(scene, world, q0, q1, 6)
    points = [q0 + (i + 1) / 6 * (q1 - q0) for i in range(6)]
    expected = np.all([fast_free(scene, world, q) for q in points], 0)
    assert 0 < expected.sum() < 64
    np.testing.assert_array_equal(free, expected)


def test_points_leave_no_gap_above_the_resolution():
    assert [points_for(x, 0.025) for x in (0.2, 0.201, 0.02)] == [8, 9, 1]


KINDS = """
<mujoco><worldbody>
  <geom name="floor" type="plane" size="1 1 1" pos="0 0 -.9" quat="1 .1 .05 0"/>
  <geom name="wall" type="box" size=".1 .3 .2" pos=".5 .2 .1" quat="1 .3 .2 .1"/>
  <geom name="ball" type="sphere" size=".15" pos="-.5 0 .3"/>
  <geom name="rod" type="capsule" size=".05 .4" pos="0 .5 .2" quat="1 .5 .2 0"/>
  <body name="upper" pos="0 0 .1" quat="1 .1 0 0"><joint name="a" axis="0 .6 .8" pos=".02 0 .1"/>
    <geom name="arm" type="capsule" size=".05 .2" pos=".2 0 0" quat="1 0 1 0"
      conaffinity="1" contype="{upper}"/>
    <body name="lower" pos=".4 0 0"><joint name="b" axis="1 0 0"/>
      <joint name="c" axis="0 1 0" type="slide" range="-.2 .2"/>
      <geom name="knob" type="sphere" size=".06" pos=".2 0 .05"/>
      <geom name="knob2" type="sphere" size=".04" pos="0 .1 .05"/>
    </body></body>
</worldbody></mujoco>"""


def test_every_kind_of_pair_agrees_with_mujoco():
    # Capsules against boxes are not in the fast backend: the arm's bits leave them out.
    xml = (
        KINDS.format(upper=1)
        .replace('name="wall"', 'name="wall" contype="2" conaffinity="2"')
        .replace('name="knob"', 'name="knob" contype="3" conaffinity="3"')
    )
    scene = Scene.from_mjcf(xml)
    kinds = {(c.a.kind, c.b.kind) for g in scene.groups for c in g.contacts}
    assert len(kinds) == 6
    rng = np.random.default_rng(6)
    q = rng.uniform([-3, -3, -0.2], [3, 3, 0.2], (500, 3))
    world = make_world(scene)
    expected = clearance_mujoco(scene, world, q, reach=0.3)
    reached = np.isfinite(expected)
    assert 0.1 < (expected < 0).mean() < 0.9
    distance = np.asarray(fast_clearance(scene, world, q))
    np.testing.assert_allclose(distance[reached], expected[reached], atol=2e-6)


SMALL = """
<mujoco><worldbody>
  <geom name="wall" type="box" size=".1 .3 .2" pos=".5 0 0"/>
  <geom name="plate" type="box" size=".3 .1 .2" pos="-.9 0 0"/>
  <geom name="floor" type="plane" size="1 1 1" pos="0 0 -.5"/>
  <body name="arm"><joint name="a" axis="0 0 1"/>
    <geom name="tip" type="sphere" size=".05" pos=".3 0 0"/>
    <geom name="tail" type="sphere" size=".05" pos="-.3 0 .1"/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("backend", ["fast", "mjx"])
def test_moving_a_geom_of_the_mjx_model_moves_the_backend(backend: str):
    scene = Scene.from_mjcf(SMALL)
    query = jax.jit(
        lambda scene, q: clearance(scene, make_world(scene), q, backend),
        compiler_options=XLA_OPTIONS,
    )
    q = np.array([[0.0], [0.4]])
    wall = scene.mj_model.geom("wall").id
    nearer = scene.replace(geom_pos=scene.model.geom_pos.at[wall, 0].set(0.44))
    larger = scene.replace(geom_size=scene.model.geom_size.at[wall, 0].set(0.17))
    half = np.sqrt(0.5)
    turned = scene.replace(
        geom_quat=scene.model.geom_quat.at[wall].set(jnp.array([half, 0, 0, half]))
    )
    for moved in (scene, nearer, larger, turned):
        expected = clearance_mujoco(moved, make_world(moved), q, reach=1.0)
        got = np.asarray(query(moved, q))
        penetrating = expected < 0
        np.testing.assert_allclose(got[penetrating], expected[penetrating], atol=1e-5)
        np.testing.assert_array_equal(got > 0, expected > 0)
        if backend == "fast":
            np.testing.assert_allclose(got, expected, atol=1e-5)
    assert (
        query._cache_size() == 2
    )  # one for `turned`: which boxes are parallel changed


def test_both_backends_give_the_same_verdict_on_the_mug_scene(scene: Scene):
    rng = np.random.default_rng(7)
    world, q = random_world(scene, rng, 96), uniform(scene, rng, 96)
    reference = jax.jit(
        lambda w, q: clearance(scene, w, q, "mjx"), compiler_options=XLA_OPTIONS
    )(world, q)
    distance = np.asarray(fast_clearance(scene, world, q))
    clear = np.abs(distance) > BAND
    np.testing.assert_array_equal((distance > 0)[clear], (reference > 0)[clear])


MARGINS = """
<mujoco><compiler angle="radian"/><worldbody>
  <geom name="floor" type="plane" size="1 1 1" pos="0 0 -.4" margin=".02"/>
  <geom name="ball" size=".1" pos=".5 0 0" margin=".01" gap=".05"/>
  <geom name="ball2" size=".1" pos="-.5 0 0"/>
  <geom name="wall" type="box" size=".1 .1 .1" pos="0 .5 0" margin=".03"/>
  <geom name="rod" type="capsule" size=".05 .1" pos="0 -.5 0"/>
  <body name="arm"><joint name="a" axis="0 0 1" range="-3 3"/>
    <joint name="b" axis="0 1 0" range="-1 1"/>
    <geom name="tip" size=".05" pos=".36 0 0" margin=".015"/>
    <geom name="tail" type="capsule" size=".05 .1" pos="-.24 0 .1" gap=".01"/></body>
</worldbody>
<contact><pair geom1="tip" geom2="wall" margin=".05" gap=".02"/></contact></mujoco>"""


@pytest.mark.parametrize("override", [False, True])
def test_the_margins_of_the_model_count_as_in_mujoco(override: bool):
    flag = '<option o_margin=".04"><flag override="enable"/></option>' * override
    scene = Scene.from_mjcf(MARGINS.replace("<worldbody>", flag + "<worldbody>", 1))
    model, world = scene.mj_model, make_world(scene)
    data, q = mujoco.MjData(model), uniform(scene, np.random.default_rng(8), 600)
    free, near = [], []
    for row in q:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        beyond = data.contact.dist - data.contact.includemargin
        free.append(not (beyond < 0).any())
        near.append((np.abs(beyond) < 1e-5).any())
    ours = np.asarray(fast_free(scene, world, q))
    assert 0.1 < np.mean(free) < 0.9
    np.testing.assert_array_equal(
        ours[~np.array(near)], np.array(free)[~np.array(near)]
    )
    distance = np.asarray(fast_clearance(scene, world, q))
    assert (~ours & (distance > 0.01)).any()
    wide = np.asarray(fast_free(scene, world, q, 0.08))
    clear = np.abs(distance - 0.08) > 1e-5
    np.testing.assert_array_equal(wide[clear], (distance > 0.08)[clear])
    table = np.asarray(required_clearances(scene))
    tip, ball, wall = (scene.mj_model.geom(n).id for n in ("tip", "ball", "wall"))
    expected = [0.04, 0.04] if override else [0.025, 0.05]
    np.testing.assert_allclose(table[[tip, tip], [ball, wall]], expected, rtol=1e-6)


@pytest.mark.long
def test_what_is_too_near_is_named_with_what_it_should_keep(tmp_path, capsys):
    """By the planner and by `jaxplan check`: not the nearest pair, if that may be so near."""
    text = MARGINS.replace('pos="-.5 0 0"', 'pos=".16 .3 .165"')
    scene = Scene.from_mjcf(text)
    model, world, planner = scene.mj_model, make_world(scene), Planner(scene)
    required = np.asarray(required_clearances(scene))
    data, q = mujoco.MjData(model), uniform(scene, np.random.default_rng(9), 6000)
    distance = np.asarray(fast_clearance(scene, world, q))
    pairs = [[model.geom(name).id for name in names] for _, *names in scene.pairs]
    not_nearest = 0
    for row in q[(distance > 1e-4) & ~np.asarray(fast_free(scene, world, q))][:80]:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        apart = [mujoco.mj_geomDistance(model, data, i, j, 1, None) for i, j in pairs]
        short = np.array([required[i, j] for i, j in pairs]) - apart
        i, j = pairs[int(short.argmax())]
        found = tightest_pair(scene, world, row, 0.0)
        assert set(found.pair or ()) == {model.geom(i).name, model.geom(j).name}
        np.testing.assert_allclose(
            found.required - found.distance, short.max(), atol=1e-5
        )
        not_nearest += int(np.argmin(apart)) != int(short.argmax())
        reason = planner.plan(row, row).reason
        words = f"apart, margin {1000 * required[i, j]:.2f} mm"
        assert reason.startswith("start in collision: ")
        assert words in reason
    assert not_nearest > 3
    path = tmp_path / "margins.xml"
    path.write_text(text)
    assert cli.main(["check", str(path), "--at", ",".join(map(str, row))]) == 1
    assert "too near" in capsys.readouterr().out


def test_pairs_that_are_always_near_keep_no_margin_beyond_it():
    scene = Scene.from_mjcf(SMALL)
    model, world = scene.mj_model, make_world(scene)
    tip, wall, floor = (model.geom(name).id for name in ("tip", "wall", "floor"))
    structure = copy.copy(scene.structure)
    object.__setattr__(structure, "near", {(wall, tip): 0.06, (tip, floor): 0.5})
    known = Scene(scene.model, structure)
    q = np.linspace(-3, 3, 400)[:, None]
    distance = np.asarray(fast_clearance(scene, world, q))
    for margin, counts in ((0.05, True), (0.07, False)):
        free = np.asarray(fast_free(known, world, q, margin))
        plain = np.asarray(fast_free(scene, world, q, margin))
        assert (free == plain).all() == counts
        assert (free >= plain).all()
        assert not free[distance < 0].any()
    swept = np.asarray(fast_free(known, world, q, 0.07, "fast", 0 * q + 0.1))
    assert (swept <= free).all()
    assert swept.sum() < free.sum()

"""Objects whose shape is data: C MuJoCo with a model compiled for each shape is the oracle."""

import jax
import mujoco
import numpy as np
import pytest
from mug_worlds import random_world

from jaxplan.collision import (
    World,
    certify,
    clearance,
    clearance_mujoco,
    config_free,
    make_world,
    motion_bound,
    pair_motion_bounds,
)
from jaxplan.collision.programs import per_scene
from jaxplan.scene import Scene
from jaxplan.tasks.mug import scene as mug_scene
from jaxplan.tasks.mug.mug import planning_geoms
from jaxplan.tasks.mug.mugs import mug_of

ROWS = 64
Q_RIM = np.array([0.137, 0.452, 0.178, -2.365, -1.131, 2.176, 0.409])
SHAPES = [mug_of(mugs, seed) for seed in range(3) for mugs in ("train", "held_out")]
ANY_KIND = """
<mujoco>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="arm" pos="0 0 0.3">
      <joint name="turn" axis="0 0 1" range="-3 3"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.04"/>
      <body name="hand" pos="0.3 0 0">
        <joint name="bend" axis="0 1 0" range="-2 2"/>
        <geom name="palm" type="box" pos="0.1 0 0" size="0.1 0.05 0.02"/>
      </body>
    </body>
    <body name="thing" pos="0.4 0.3 0.3">
      <freejoint/>
      {}
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def shaped():
    """The mug's scene with mugs of any shape."""
    return Scene.from_mjcf(mug_scene.build("planning"), shaped=["mug"])


@pytest.fixture(scope="module")
def free():
    """`config_free` with the planner's margin, and how often it was compiled."""
    traced = []

    @per_scene
    def program(scene, world, q):
        traced.append(scene.structure)
        return config_free(scene, world, q, margin=0.005)

    return program, traced


def with_shape(scene: Scene, world: World, shape, rows: int) -> World:
    geoms = planning_geoms(shape)
    pos, size = zip(*(geoms[scene.geom_name(g)] for g in scene.shaped), strict=True)
    each = [np.tile(np.float32(leaf), (rows, 1, 1)) for leaf in (pos, size)]
    return world._replace(geom_pos=each[0], geom_size=each[1])


def some(scene: Scene, rng: np.random.Generator, rows: int = ROWS):
    """Worlds and joints, half of these near a grasp."""
    q = rng.uniform(np.asarray(scene.q_min), np.asarray(scene.q_max), (rows, 7))
    q[::2] = Q_RIM + rng.normal(0, 0.15, q[::2].shape)
    return random_world(scene, rng, rows), q.astype(np.float32)


def test_each_shape_is_as_if_compiled_for_it(shaped, free):
    """Verdicts and distances, of one program, are those of a scene read from that shape's MJCF."""
    program, traced = free
    rng, before = np.random.default_rng(0), len(traced)
    batch = []
    for shape in SHAPES:
        fresh = Scene.from_mjcf(mug_scene.build("planning", shape))
        worlds, q = some(fresh, rng)
        own = with_shape(shaped, worlds, shape, ROWS)
        theirs = clearance_mujoco(fresh, worlds, q, reach=0.05)
        verdicts = np.asarray(program(shaped, own, q))
        certain = np.abs(theirs - 0.005) > 1e-5
        np.testing.assert_array_equal(verdicts[certain], (theirs > 0.005)[certain])
        assert 0.2 < verdicts.mean() < 0.98
        replica = clearance_mujoco(shaped, own, q, reach=0.05)
        np.testing.assert_array_equal(replica, theirs)
        batch.append((own, q, verdicts))
    assert traced[before:].count(shaped.structure) == 1, "a shape compiles nothing"
    # All of them side by side, in another order.
    order = rng.permutation(len(SHAPES) * ROWS)[:ROWS]
    worlds, q, verdicts = jax.tree.map(
        lambda *leaves: np.concatenate(leaves)[order], *batch
    )
    np.testing.assert_array_equal(program(shaped, worlds, q), verdicts)


def test_distances_and_bounds_are_those_of_a_compiled_shape(shaped):
    """Bit for bit: what is data and what is a constant goes the same way."""
    rng, shape = np.random.default_rng(1), SHAPES[1]
    fresh = Scene.from_mjcf(mug_scene.build("planning", shape))
    worlds, q = some(fresh, rng, 32)
    own = with_shape(shaped, worlds, shape, 32)
    motion = np.full_like(q, 0.01)
    for given in ({}, {"motion": motion}):
        program = per_scene(lambda s, w, q, g=given: clearance(s, w, q, **g))
        np.testing.assert_array_equal(
            program(shaped, own, q), program(fresh, worlds, q)
        )
    bound = per_scene(lambda s, w, q: motion_bound(s, w, q))
    np.testing.assert_allclose(
        bound(shaped, own, motion), bound(fresh, worlds, motion), rtol=1e-6
    )
    one, same = (jax.tree.map(lambda leaf: leaf[0], w) for w in (own, worlds))
    np.testing.assert_allclose(
        pair_motion_bounds(shaped, one, motion[0]),
        pair_motion_bounds(fresh, same, motion[0]),
        rtol=1e-6,
    )


def test_a_path_is_certified_with_its_shape(shaped):
    """The same path, past two mugs of which one is too large."""
    pose = np.array([[0.55, 0.0, 0.06, 1, 0, 0, 0]])
    path = Q_RIM + np.linspace(-0.4, 0.4, 5)[:, None] * np.eye(7)[0]
    found = []
    for shape in SHAPES:
        fresh = Scene.from_mjcf(mug_scene.build("planning", shape))
        plain = make_world(fresh, pose)
        own = with_shape(shaped, plain, shape, 1)
        own = own._replace(geom_pos=own.geom_pos[0], geom_size=own.geom_size[0])
        mine, theirs = certify(shaped, own, path), certify(fresh, plain, path)
        assert mine.valid == theirs.valid
        assert mine.clearance == pytest.approx(theirs.clearance, abs=1e-6)
        assert mine.pair == theirs.pair
        found.append(mine.clearance)
    assert len(np.unique(np.round(found, 4))) > 3, "shapes matter to this path"


KINDS = {
    "sphere": '<geom name="own" type="sphere" size="{0}"/>',
    "capsule": '<geom name="own" type="capsule" size="{0} {1}"/>',
    "cylinder": '<geom name="own" type="cylinder" size="{0} {1}"/>',
    "ellipsoid": '<geom name="own" type="ellipsoid" size="{0} {1} {2}"/>',
    "box": '<geom name="own" type="box" size="{0} {1} {2}"/>',
}


@pytest.mark.parametrize("kind", KINDS)
def test_any_kind_may_be_shaped(kind):
    """Held or not, by both distances."""
    rng = np.random.default_rng(2)
    text = KINDS[kind]
    scene = Scene.from_mjcf(
        ANY_KIND.format(text.format(0.05, 0.05, 0.05)), shaped=["thing"]
    )
    program = per_scene(lambda s, w, q: clearance(s, w, q))
    for held in (False, True):
        for _ in range(2):
            sizes, place = rng.uniform(0.02, 0.12, 3), rng.uniform(-0.1, 0.1, 3)
            geom = text.format(*sizes).replace(
                "/>", f' pos="{place[0]} {place[1]} {place[2]}"/>'
            )
            fresh = Scene.from_mjcf(ANY_KIND.format(geom))
            ids = [fresh.mj_model.geom("own").id]
            q = rng.uniform(-1.5, 1.5, (16, 2))
            quat = rng.normal(size=4)
            middle = (0.25, 0.0, 0.1) if held else (0.3, 0.2, 0.35)
            pose = np.array([[*middle, *(quat / np.linalg.norm(quat))]])
            ignored = ["hand|thing"] if held else []
            theirs = clearance_mujoco(
                fresh, make_world(fresh, pose, [held], ignored=ignored), q
            )
            own = make_world(
                scene,
                pose,
                [held],
                ignored=ignored,
                geom_pos=fresh.mj_model.geom_pos[ids],
                geom_size=fresh.mj_model.geom_size[ids],
            )
            assert scene.geom_name(scene.shaped[0]) == "own"
            ours = np.asarray(program(scene, own, q))
            apart = np.isfinite(theirs) & (theirs > 0)
            np.testing.assert_allclose(ours[apart], theirs[apart], atol=1e-4)
            np.testing.assert_array_equal(
                ours[np.isfinite(theirs)] > 0, theirs[np.isfinite(theirs)] > 0
            )


def test_what_cannot_be_shaped_is_refused():
    mesh = mujoco.MjSpec.from_string(ANY_KIND.format('<geom size="0.05"/>'))
    corners = np.array(np.meshgrid(*[[-0.1, 0.1]] * 3)).reshape(3, -1).T
    mesh.add_mesh(name="block", uservert=corners.ravel())
    mesh.body("thing").add_geom(
        name="rock", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="block"
    )
    with pytest.raises(
        ValueError, match="'rock' is a mesh, which has no size to be given"
    ):
        Scene.from_mjcf(mesh, shaped=["thing"])
    plain = ANY_KIND.format('<geom name="ball" size="0.05"/>')
    with pytest.raises(
        ValueError, match="no movable object 'thin': did you mean 'thing'"
    ):
        Scene.from_mjcf(plain, shaped=["thin"])
    scene = Scene.from_mjcf(plain, shaped=["thing"])
    with pytest.raises(
        ValueError, match=r"geom_size has shape \(2, 3\), expected .* ball"
    ):
        make_world(scene, geom_size=np.ones((2, 3)))
    world = make_world(scene, geom_pos=np.full((1, 3), np.nan))
    assert np.isnan(clearance(scene, world, np.zeros(2)))
    assert "'ball' is not finite" in certify(scene, world, np.zeros((1, 2))).reason
    world = make_world(scene, geom_size=-np.ones((1, 3)))
    assert (
        "'ball' has a negative size" in certify(scene, world, np.zeros((1, 2))).reason
    )


def test_a_scene_without_them_has_nothing_of_them(shaped):
    """Replacing other numbers keeps what is shaped."""
    plain = Scene.from_mjcf(mug_scene.build("planning"))
    assert plain.shaped == ()
    assert make_world(plain).geom_pos.shape == (0, 3)
    turned = shaped.replace(geom_quat=np.asarray(shaped.model.geom_quat))
    assert turned.shaped == shaped.shaped

"""Bounds on motion, and certificates that hold between samples."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan.collision import World, certify, faults, make_world
from jaxplan.collision.course import Course
from jaxplan.collision.oracle import Replica
from jaxplan.collision.travel import Travel
from jaxplan.scene import Scene

ARM = """<mujoco><compiler angle="radian"/><worldbody>
  <body name="rocks" pos=".4 0 .3">
    <geom name="ball" type="sphere" size=".05"/>
    <geom name="brick" type="box" size=".05 .04 .06" pos="-.1 .5 .2"/>
    <geom name="log" type="capsule" size=".03 .1" pos="-.6 -.4 .3"/>
    <geom name="egg" type="ellipsoid" size=".04 .06 .05" pos="-.3 -.5 .1"/>
  </body>
  <body name="rail"><joint name="rail" type="slide" axis="1 0 0" range="-1 1"/>
    <geom name="cart" type="box" size=".04 .03 .02"/>
    <body name="upper" pos="0 0 .1"><joint name="shoulder" axis="0 0 1" range="-3 3"/>
      <geom name="upper" type="capsule" size=".02 .08" pos="0 0 .1"/>
      <body name="fore" pos="0 0 .2"><joint name="elbow" axis="0 1 0" range="-3 3"/>
        <joint name="twist" axis="0 0 1" range="-3 3"/>
        <geom name="fore" type="cylinder" size=".015 .08" pos="0 0 .1"/>
        <geom name="tip" type="sphere" size=".02" pos="0 0 .2"/>
        <body name="claw" pos=".05 0 .1"><joint name="claw" type="slide"/>
          <geom name="claw" type="sphere" size=".01"/></body>
  </body></body></body>
  <body name="cup" pos="0 0 9"><freejoint/><geom name="cup" type="cylinder" size=".03 .04"/>
  </body>
</worldbody><equality><joint joint1="claw" joint2="elbow" polycoef=".01 .05 .03 0 0"/>
</equality></mujoco>"""


ROCKS = "ball", "brick", "log", "egg"


@pytest.fixture(scope="module")
def arm() -> Scene:
    return Scene.from_mjcf(ARM)


def drawn(arm: Scene, rng: np.random.Generator) -> tuple[Scene, World]:
    """The arm with other numbers, which compile nothing, and a world; half hold the cup."""
    numbers = arm.model
    axis = rng.normal(size=numbers.jnt_axis.shape)
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    scale = rng.uniform(0.5, 2, numbers.geom_size.shape)
    scene = arm.replace(
        jnt_axis=jnp.asarray(axis, jnp.float32),
        jnt_pos=numbers.jnt_pos + rng.normal(0, 0.03, numbers.jnt_pos.shape),
        geom_size=numbers.geom_size * scale,
        geom_pos=numbers.geom_pos + rng.normal(0, 0.02, numbers.geom_pos.shape),
    )
    pose = [*rng.normal(0, 0.05, 3), *rng.normal(size=4)]
    held = bool(rng.random() < 0.5)
    pose = pose if held else [0, 0, 9, 1, 0, 0, 0]
    in_hand = ("claw|cup", "cup|fore")
    return scene, make_world(scene, [pose], held=[held], ignored=in_hand)


def points_of(replica: Replica) -> np.ndarray:
    """`[ngeom, 7, 3]` points of each geom's core: its middle, and ends along its axes."""
    model, data = replica.model, replica.data
    half = {2: lambda s: 0 * s, 3: lambda s: s * [0, 0, 0]}
    points = []
    for geom, (kind, size) in enumerate(
        zip(model.geom_type, model.geom_size, strict=True)
    ):
        reach = half.get(int(kind), lambda s: s)(size)
        if kind == 3:  # a capsule: the ends of its line
            reach = np.array([0, 0, size[1]])
        if kind == 5:  # a cylinder: radius, radius, half length
            reach = np.array([size[0], size[0], size[1]])
        local = np.concatenate([np.zeros((1, 3)), np.diag(reach), -np.diag(reach)])
        turn = data.geom_xmat[geom].reshape(3, 3)
        points.append(data.geom_xpos[geom] + local @ turn.T)
    return np.array(points)


def distances(replica: Replica, q: np.ndarray, world: World) -> np.ndarray:
    """Of all points of all geoms from all of all others."""
    replica.load(world, q[None])
    replica.pose(0)
    points = points_of(replica)
    return np.linalg.norm(points[:, None, :, None] - points[None, :, None], axis=-1)


def test_no_two_geoms_move_farther_than_their_bound(arm: Scene):
    rng = np.random.default_rng(0)
    tight = []
    for _ in range(30):
        scene, world = drawn(arm, rng)
        world = faults.one_world(scene, world)
        replica = Replica(scene)
        middle = rng.uniform(-1, 1, 4)
        half = 10 ** rng.uniform(-3, 0, 4) * (rng.random(4) < 0.7)
        before = distances(replica, middle, world)
        ends = np.stack([middle - half, middle + half])
        travel = Travel(scene, replica, np.asarray(world.held), ends)
        sides = travel.sides(half)
        table = scene.group_table()
        i, j = np.nonzero((table >= 0) & replica.counts[0][table])
        bound = travel.pair(sides, np.stack([i, j], -1))
        assert travel.most(sides) == pytest.approx(bound.max())
        for _ in range(20):
            corner = rng.choice([-1, 1, rng.uniform(-1, 1)], 4)
            after = distances(replica, middle + half * corner, world)
            moved = np.abs(after - before).max((2, 3))[i, j]
            assert (moved <= bound + 1e-9).all()
            tight.append((moved / np.maximum(bound, 1e-9)).max())
    assert np.max(tight) > 0.8  # a bound that is infinite would pass


def test_geoms_move_by_no_more_than_the_resolution_between_places(arm: Scene):
    rng = np.random.default_rng(1)
    for _ in range(5):
        scene, world = drawn(arm, rng)
        world = faults.one_world(scene, world)
        course = Course(scene, world, rng.uniform(-1, 1, (4, 4)))
        for resolution in (0.01, 0.05, 3.0):
            rows = course.rows(course.places(resolution))
            table = scene.group_table()
            replica = Replica(scene)
            pairs = [distances(replica, q, world) for q in rows]
            counts = (table >= 0) & replica.counts[0][table]
            steps = np.abs(np.diff(pairs, axis=0)).max((0, 3, 4))
            assert steps[counts].max() <= resolution + 1e-9


TARGETS = -0.004, -0.0013, -0.0007, 0.0, 0.0003, 0.0025, 0.01
"""About how near a path passes an obstacle [m]."""


def grazing(
    scene: Scene, world: World, path: np.ndarray, rock: str, way: np.ndarray
) -> Callable[[float], Scene]:
    """Scenes in which the rock is so near to the path, off the tip in a direction."""
    model = scene.mj_model
    replica = Replica(scene)
    replica.load(world, path[1:2])
    replica.pose(0)
    tip, body = model.geom("tip").id, model.body("rocks").pos
    rocks = [model.geom(name).id for name in ROCKS]
    away = scene.model.geom_pos.at[np.array(rocks)].add(jnp.array([0.0, 0, 3]))
    at = replica.data.geom_xpos[tip] - body

    def at_distance(distance: float) -> Scene:
        place = away.at[model.geom(rock).id].set(at + distance * way)
        return scene.replace(geom_pos=place)

    # By the rocks' contacts only: others stay as near as they are.
    others = np.array(["rocks" not in group.name for group in scene.groups])
    alone = world._replace(ignored=others)
    low, high = 0.0, 0.4
    for _ in range(12):
        middle = (low + high) / 2
        touches = certify(at_distance(middle), alone, path, tolerance=9).clearance < 0
        low, high = (middle, high) if touches else (low, middle)
    return lambda least: at_distance(high + least)


@pytest.mark.parametrize("rock", ROCKS)
def test_what_is_proven_holds_at_a_tenth_of_a_millimetre(arm: Scene, rock: str):
    """And what is free by 2 mm is proven."""
    rng = np.random.default_rng(ROCKS.index(rock))
    seen = []
    for tolerance in (0.0, 0.001) * 2:
        scene, world = drawn(arm, rng)
        world = faults.one_world(scene, world)
        path = rng.uniform(-0.8, 0.8, 4) + rng.uniform(-0.1, 0.1, (3, 4))
        way = rng.normal(size=3)
        near = grazing(scene, world, path, rock, way / np.linalg.norm(way))
        for target in TARGETS:
            there = near(target)
            fine = certify(there, world, path, 1e-4, tolerance)
            proof = certify(there, world, path, 0.005, tolerance, continuous=True)
            seen.append((proof.valid, fine.valid))
            assert proof.proven == proof.valid == (not proof.reason)
            if proof.valid:
                assert fine.valid, (fine.reason, proof)
                assert certify(there, world, path, 0.05, tolerance).valid
                assert fine.clearance - 0.006 <= proof.clearance <= fine.clearance
            if fine.clearance >= 0.002:
                assert proof.valid, proof.reason
    assert {(True, True), (False, False)} <= set(seen)


LID = """<mujoco><compiler angle="radian"/><worldbody>
  <geom name="pot" type="sphere" size=".1"/>
  <body pos="0 0 .15"><joint name="j" axis="0 0 1" range="-2 2"/>
    <geom name="lid" type="box" size=".1 .1 .05"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def lid() -> Callable[[float], Scene]:
    """A lid so high over a pot, compiled once."""
    scene = Scene.from_mjcf(LID, exclude=None)
    lift = np.array([[0, 0, 0], [0, 0, 1]])
    return lambda gap: scene.replace(body_pos=scene.model.body_pos + gap * lift)


@pytest.mark.parametrize(("gap", "tolerance"), [(2e-4, 0.0), (-5e-4, 0.001)])
def test_what_is_always_near_is_proven_all_the_same(
    lid: Callable[[float], Scene], gap: float, tolerance: float
):
    """The lid's corners move by 300 mm, 0.2 mm over the pot or as little in it."""
    scene = lid(gap)
    path = [[-1.0], [1.0]]
    certificate = certify(
        scene, make_world(scene), path, tolerance=tolerance, continuous=True
    )
    assert certificate.proven
    assert set(certificate.pair) == {"lid", "pot"}
    assert -tolerance <= certificate.clearance <= gap + 1e-6


def test_what_cannot_be_proven_is_named(lid: Callable[[float], Scene]):
    """The lid all but lies on the pot, by 0.01 mm: free at each sample."""
    scene = lid(1e-5)
    world, path = make_world(scene), [[-1.0], [1.0]]
    assert certify(scene, world, path, tolerance=0.0).valid
    certificate = certify(scene, world, path, tolerance=0.0, continuous=True)
    assert not certificate.valid
    assert certificate.proven is False
    assert set(certificate.pair) == {"lid", "pot"}
    assert certificate.reason.startswith("not proven: ")
    assert "0.01 mm apart" in certificate.reason
    np.testing.assert_allclose(certificate.clearance, 1e-5, atol=2e-6)


def test_a_wall_between_coarse_samples_is_a_collision():
    scene = Scene.from_mjcf("""<mujoco><worldbody>
      <geom name="wall" type="box" size=".0005 .2 .2" pos=".5 0 0"/>
      <body><joint name="x" type="slide" axis="1 0 0"/><geom name="tip" size=".003"/></body>
    </worldbody></mujoco>""")
    path = [[0.0], [0.9]]
    assert certify(scene, make_world(scene), path, resolution=1.0).valid
    certificate = certify(scene, make_world(scene), path, 1.0, continuous=True)
    assert not certificate.valid
    assert set(certificate.pair) == {"tip", "wall"}
    np.testing.assert_allclose(certificate.where, 0.5 / 0.9, atol=0.01)
    assert " mm deep at 0.5" in certificate.reason


def test_without_pairs_everything_is_proven():
    scene = Scene.from_mjcf(LID.replace("<geom", '<geom contype="0"'))
    certificate = certify(scene, make_world(scene), [[-1.0], [1.0]], continuous=True)
    assert certificate.proven
    assert certificate.pair is None

"""C MuJoCo as the last word on a path."""

import numpy as np
import pytest

from jaxplan.collision import (
    Obstacle,
    always_touching,
    certify,
    clearance,
    clearance_mujoco,
    closest_pair,
    config_free,
    make_world,
)
from jaxplan.scene import Scene
from jaxplan.tasks.mug.scene import Q_HOME, build

SLIDER = """
<mujoco><worldbody>
  <geom name="post" type="sphere" size=".1" pos=".5 .14 0"/>
  <body name="arm"><joint name="x" type="slide" axis="1 0 0"/>
    <geom name="tip" type="sphere" size=".05"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(SLIDER)


def test_a_planted_collision_is_found_named_and_placed(scene: Scene):
    certificate = certify(scene, make_world(scene), [[0.0], [0.3], [0.7], [1.0]])
    assert not certificate.valid
    assert set(certificate.pair) == {"tip", "post"}
    np.testing.assert_allclose(certificate.clearance, 0.14 - 0.15, atol=1e-7)
    np.testing.assert_allclose(certificate.where, 1.5, atol=0.02)
    np.testing.assert_allclose(certificate.q, [0.5], atol=0.01)


def test_the_tolerance_and_the_resolution_decide(scene: Scene):
    world = make_world(scene)
    assert certify(scene, world, [[0.0], [1.0]], tolerance=0.011).valid
    # Both ends are free, and a gap of 1 m sees nothing between them.
    assert certify(scene, world, [[0.0], [1.0]], resolution=1.0).valid


def test_a_free_path_has_no_pair(scene: Scene):
    certificate = certify(scene, make_world(scene), [[0.0], [0.2]])
    assert certificate.valid
    assert certificate.pair is None


def test_a_path_that_is_not_finite_is_refused(scene: Scene):
    assert not certify(scene, make_world(scene), [[0.0], [np.nan]]).valid


def test_mug_scene_names_what_meets():
    scene = Scene.from_mjcf(build("planning"))
    low = Q_HOME + np.array([0, 1.2, 0, 0, 0, 0, 0])
    assert not certify(scene, make_world(scene), [Q_HOME, low]).valid
    far = make_world(scene, [[-2, 0, 0.0475, 1, 0, 0, 0]])
    certificate = certify(scene, far, [Q_HOME, low])
    assert not certificate.valid
    assert "table_planning" in certificate.pair
    pair, depth = closest_pair(scene, far, low)
    assert "table_planning" in pair
    assert depth < -0.001
    assert closest_pair(scene, make_world(scene), Q_HOME, reach=0.001)[0] is None


def test_a_held_mug_is_carried_by_the_hand():
    scene = Scene.from_mjcf(build("planning"))
    below = make_world(scene, [[0, 0, 0.6, 1, 0, 0, 0]], held=[True])
    (table, mug), depth = closest_pair(scene, below, Q_HOME)
    assert table == "table_planning"
    assert mug.startswith("mug_sphere")
    assert depth < 0


SILENT = """<mujoco><worldbody>
  <geom name="post" size=".1" contype="0" conaffinity="0"/>
  <body name="a" pos="0 0 .22"><joint name="j" type="slide" axis="0 0 1"/>
    <geom name="g" size=".1" contype="0" conaffinity="0"/></body>
</worldbody><contact><pair geom1="post" geom2="g"/></contact></mujoco>"""


def test_the_oracle_sees_explicit_pairs_that_are_apart():
    scene, q = Scene.from_mjcf(SILENT), np.array([[0.0], [-0.01], [-0.03]])
    distances = clearance_mujoco(scene, make_world(scene), q)
    np.testing.assert_allclose(distances, [0.02, 0.01, -0.01], atol=1e-7)
    ours = clearance(scene, make_world(scene), q)
    np.testing.assert_allclose(ours, distances, atol=1e-6)


def test_a_slot_touches_a_geom_that_only_an_explicit_pair_names():
    scene = Scene.from_mjcf(SILENT, slots={"box": 1})
    box = Obstacle("box", (0.1, 0.1, 0.1), (0.0, 0.0, 0.52))
    world, q = make_world(scene, obstacles=[box]), np.array([[0.09], [0.11]])
    np.testing.assert_allclose(
        clearance_mujoco(scene, world, q), [0.01, -0.01], atol=1e-6
    )
    np.testing.assert_allclose(clearance(scene, world, q), [0.01, -0.01], atol=1e-6)


def test_contacts_that_the_model_switches_off_are_checked_all_the_same():
    off = '<option><flag contact="disable"/></option>'
    scene = Scene.from_mjcf(SLIDER.replace("<worldbody>", off + "<worldbody>"))
    assert not certify(scene, make_world(scene), [[0.5]]).valid


def test_without_pairs_everything_is_free():
    scene = Scene.from_mjcf(SLIDER.replace("<geom", '<geom contype="0"'))
    world, q = make_world(scene), np.array([[0.5], [np.nan]])
    np.testing.assert_array_equal(clearance(scene, world, q), [np.inf, np.nan])
    np.testing.assert_array_equal(config_free(scene, world, q), [True, False])
    np.testing.assert_array_equal(clearance_mujoco(scene, world, q[:1]), [np.inf])
    assert certify(scene, world, [[0.0], [1.0]]).valid


def test_a_mocap_body_is_placed_by_the_world():
    ball = '<body name="ball" mocap="true" pos="0 0 9"><geom size=".1"/></body>'
    scene = Scene.from_mjcf(SLIDER.replace("</worldbody>", ball + "</worldbody>"))
    assert scene.objects == scene.mocap == ("ball",)
    q = np.array([[0.0], [0.2]])
    for x in (0.16, 0.4):
        world = make_world(scene, [[x, 0, 0, 1, 0, 0, 0]])
        expected = np.abs(q[:, 0] - x) - 0.15
        np.testing.assert_allclose(
            clearance_mujoco(scene, world, q, reach=1.0), expected, atol=1e-6
        )
        np.testing.assert_allclose(clearance(scene, world, q), expected, atol=1e-6)
    with pytest.raises(ValueError, match=r"cannot be held.*: ball"):
        make_world(scene, held=[True])


def test_what_always_touches_is_found():
    scene = Scene.from_mjcf("""<mujoco><worldbody>
      <body name="base"><geom size=".1"/><body name="a"><joint name="a"/>
        <geom size=".01"/><body name="b" pos="0 0 .05"><joint name="b"/>
          <geom size=".01" pos="0 0 .04"/>
          <body name="palm" pos="0 0 .3"><geom size=".01"/>
            <body name="left"><joint name="left" type="slide"/>
              <geom size=".01" pos=".1 0 0"/></body>
            <body name="right"><joint name="right" type="slide"/>
              <geom size=".01" pos="-.1 0 0"/></body>
      </body></body></body></body></worldbody></mujoco>""")
    assert scene.joints == ("a", "b")
    found = dict(always_touching(scene))
    # A link on a base that does not move is no child of it to MuJoCo's filter.
    # What no joint of the arm moves against each other (left, right) counts for nothing.
    assert found == {"a|base": 1.0, "b|base": 1.0}


def test_distances_of_a_capsule_and_a_cylinder_are_those_of_geometry():
    rng = np.random.default_rng(0)
    radius, half, tube, reach = 0.06, 0.1, 0.04, 0.2
    for _ in range(20):
        ends = rng.uniform(-0.4, 0.4, (2, 3))
        scene = Scene.from_mjcf(f"""<mujoco><worldbody>
          <geom type="cylinder" size="{radius} {half}"/>
          <body><joint type="slide" axis="1 0 0"/><geom type="capsule" size="{tube}"
            fromto="{" ".join(map(str, ends.ravel()))}"/></body>
        </worldbody></mujoco>""")
        q = np.linspace(-0.5, 0.5, 41)[:, None]
        points = ends[0] + np.linspace(0, 1, 4001)[:, None] * (ends[1] - ends[0])
        points = points + q[..., None] * [1, 0, 0]
        out = np.hypot(points[..., 0], points[..., 1]) - radius
        up = np.abs(points[..., 2]) - half
        axis = np.hypot(np.maximum(out, 0), np.maximum(up, 0)).min(-1)
        # Deeper, where the capsule's axis itself is inside, the depth is another one.
        known = (axis > 1e-4) & (axis < reach)
        theirs = clearance_mujoco(scene, make_world(scene), q, reach)
        np.testing.assert_allclose(theirs[known], (axis - tube)[known], atol=2e-5)

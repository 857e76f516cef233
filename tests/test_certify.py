"""C MuJoCo as the last word on a path."""

import numpy as np
import pytest

from jaxplan.collision import certify, closest_pair, make_world
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
    np.testing.assert_allclose(certificate.clearance, 0.14 - 0.15, atol=1e-9)
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

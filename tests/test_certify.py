"""C MuJoCo as the last word on a path."""

import numpy as np
import pytest

from jaxplan.collision import (
    Obstacle,
    World,
    always_touching,
    certify,
    clearance,
    clearance_mujoco,
    closest_pair,
    config_free,
    make_world,
)
from jaxplan.robots import PANDA
from jaxplan.scene import Scene
from jaxplan.tasks.mug.scene import build

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


def test_the_tolerance_decides(scene: Scene):
    world = make_world(scene)
    assert certify(scene, world, [[0.0], [1.0]], tolerance=0.011).valid
    refused = certify(scene, world, [[0.0], [1.0]], tolerance=0.009)
    assert not refused.valid
    for words in ("tip", "post", "10.00 mm deep", "at 0.5", "C MuJoCo and jaxplan"):
        assert words in refused.reason


def test_a_free_path_says_how_free_it_is(scene: Scene):
    certificate = certify(scene, make_world(scene), [[0.0], [0.4]])
    assert certificate.valid
    assert not certificate.reason
    assert set(certificate.pair) == {"tip", "post"}
    np.testing.assert_allclose(
        certificate.clearance, np.hypot(0.1, 0.14) - 0.15, atol=1e-6
    )
    assert certificate.where == 1
    far = certify(scene, make_world(scene), [[0.0]])
    assert far.pair is None
    assert far.valid


def test_a_path_of_one_waypoint_is_checked(scene: Scene):
    for continuous in (False, True):
        assert certify(scene, make_world(scene), [[0.2]], continuous=continuous).valid
        certificate = certify(scene, make_world(scene), [[0.5]], continuous=continuous)
        assert not certificate.valid
        assert certificate.where == 0


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ([[0.0], [np.nan]], "waypoint 1: joint 'x' is nan"),
        ([[np.inf], [0.0]], "waypoint 0: joint 'x' is inf"),
    ],
)
def test_a_path_that_is_not_finite_is_refused(scene: Scene, path, words):
    certificate = certify(scene, make_world(scene), path)
    assert not certificate.valid
    assert words in certificate.reason


def test_a_path_outside_the_joint_limits_is_refused():
    limited = SLIDER.replace('name="x"', 'name="x" range="-1 .3"')
    scene = Scene.from_mjcf(limited)
    world = make_world(scene)
    assert certify(scene, world, [[0.0], [0.30009]]).valid
    certificate = certify(scene, world, [[0.0], [0.3002], [0.0]])
    assert not certificate.valid
    assert certificate.where == 1
    assert "waypoint 1 out of limits: joint 'x' at 0.3002" in certificate.reason


WRONG_PATHS = {
    "too wide": [[0.0, 1.0]],
    "too narrow": np.zeros((3, 0)),
    "one axis": [0.0, 1.0],
    "three axes": [[[0.0]]],
    "empty": [],
    "no waypoints": np.zeros((0, 1)),
    "strings": [["a"]],
    "objects": [[object()]],
    "ragged": [[0.0], [0.0, 1.0]],
    "complex": [[1j]],
    "none": None,
}


@pytest.mark.parametrize("path", WRONG_PATHS.values(), ids=WRONG_PATHS)
def test_a_path_of_another_shape_is_a_value_error(scene: Scene, path):
    with pytest.raises(ValueError, match=r"^path [^\n]*$"):
        certify(scene, make_world(scene), path)


@pytest.mark.parametrize(
    "value", [0, -1, np.nan, np.inf, -np.inf, "0.1", None, True, 1j]
)
@pytest.mark.parametrize("name", ["resolution", "tolerance"])
def test_settings_that_make_no_sense_are_value_errors(scene: Scene, name: str, value):
    if name == "tolerance" and value is not True and value == 0:
        assert certify(scene, make_world(scene), [[0.0]], tolerance=0).valid
        return
    with pytest.raises(ValueError, match=rf"^{name} [^\n]*expected[^\n]*$"):
        certify(scene, make_world(scene), [[0.0], [1.0]], **{name: value})


FULL = """<mujoco><worldbody>
  <body name="arm"><joint name="x" type="slide" axis="1 0 0"/><geom name="tip" size=".05"/>
    <body name="finger" pos=".1 0 0"><joint name="f" type="slide"/><geom size=".01"/></body>
  </body>
  <body name="mug" pos="0 0 1"><freejoint/><geom size=".1"/></body>
  <body name="ball" mocap="true" pos="0 0 2"><geom size=".1"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def full() -> Scene:
    return Scene.from_mjcf(
        FULL,
        joints=["x"],
        hand="arm",
        slots={"box": 1, "sphere": 1},
        shaped=["mug"],
    )


def broken_worlds(scene: Scene) -> dict[str, tuple[World, str]]:
    """A world for each leaf and each of its entries that is broken, and what it breaks."""
    good = World(*map(np.asarray, make_world(scene)))
    found = {}
    shaped = [scene.geom_name(geom) for geom in scene.shaped]
    leaves = "object_pose", "passive", "slot_pose", "slot_size", "geom_pos", "geom_size"
    for name in leaves:
        leaf = getattr(good, name)
        for value in (np.nan, np.inf, -np.inf):
            for index in np.ndindex(leaf.shape):
                broken = leaf.copy()
                broken[index] = value
                world = good._replace(**{name: broken})
                owner = {
                    "object_pose": scene.objects,
                    "passive": scene.passive,
                    "geom_pos": shaped,
                    "geom_size": shaped,
                }.get(name, ("box0", "sphere0"))[index[0]]
                found[f"{name}{index} {value}"] = world, owner
    for name in ("object_pose", "slot_pose"):
        for row in range(2):
            broken = getattr(good, name).copy()
            broken[row, 3:] = 0
            owner = (scene.objects if name == "object_pose" else ("box0", "sphere0"))[
                row
            ]
            found[f"{name}{row} no turn"] = good._replace(**{name: broken}), owner
    for index in np.ndindex(2, 3):
        size = good.slot_size.copy()
        size[index] = -0.1
        found[f"slot_size{index} negative"] = good._replace(slot_size=size), "negative"
    for k in range(3):
        size = good.geom_size.copy()
        size[0, k] = -0.1
        found[f"geom_size{k} negative"] = good._replace(geom_size=size), "negative"
    held = good._replace(held=np.array([False, True]))
    return found | {"a mocap body in the hand": (held, "ball")}


def test_a_world_that_makes_no_sense_is_refused_and_named(full: Scene):
    for name, (world, words) in broken_worlds(full).items():
        certificate = certify(full, world, [[0.0], [0.1]])
        assert not certificate.valid, name
        assert words in certificate.reason, name
    assert certify(full, make_world(full), [[0.0], [0.1]]).valid


def test_a_scene_of_nan_is_refused(full: Scene):
    for name, leaf in full.model._asdict().items():
        if name == "geom_quat":
            continue  # structure, see `Scene.replace`
        broken = full.replace(**{name: leaf.at[(0,) * leaf.ndim].set(np.nan)})
        certificate = certify(broken, make_world(full), [[0.0]])
        assert not certificate.valid
        assert name in certificate.reason


def test_batch_axes_and_worlds_of_other_scenes_are_value_errors(full: Scene):
    world = make_world(full)
    for name, leaf in world._asdict().items():
        for count in (1, 3):
            batch = world._replace(
                **{name: np.broadcast_to(leaf, (count, *leaf.shape))}
            )
            with pytest.raises(ValueError, match=rf"^world\.{name} .*batch axes"):
                certify(full, batch, [[0.0]])
        other = world._replace(**{name: np.asarray(leaf)[:-1]})
        with pytest.raises(ValueError, match=rf"^world\.{name} has shape .*this scene"):
            certify(full, other, [[0.0]])
    for other in (None, "world", tuple(world), world._replace(held="no")):
        with pytest.raises(ValueError, match=r"^world"):
            certify(full, other, [[0.0]])


def test_joints_without_limits_go_the_short_way_round():
    scene = Scene.from_mjcf(
        """<mujoco><compiler angle="radian"/><worldbody>
      <geom name="wall" type="box" size=".1 .1 .1" pos=".5 0 0"/>
      <body><joint name="j" axis="0 0 1"/><geom name="tip" size=".02" pos=".5 0 0"/></body>
    </worldbody></mujoco>"""
    )
    world = make_world(scene)
    assert certify(scene, world, [[3.0], [-3.0]]).valid
    assert certify(scene, world, [[3.0], [2 * np.pi - 3.0], [3.0 + 2 * np.pi]]).valid
    assert not certify(scene, world, [[0.3], [-0.3]]).valid
    assert not certify(scene, world, [[0.3 + 6 * np.pi], [-0.3]]).valid


THIN = """<mujoco><worldbody>
  <geom name="wall" type="box" size=".0005 .2 .2" pos=".5 0 0"/>
  <body name="arm"><joint name="x" type="slide" axis="1 0 0" range="-2 2"/>
    <geom name="tip" {}/></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder", "ellipsoid", "box"])
def test_a_small_robot_on_a_slide_does_not_jump_a_thin_wall(kind: str):
    scene = Scene.from_mjcf(THIN.format(f'type="{kind}" size=".003 .003 .003"'))
    certificate = certify(scene, make_world(scene), [[0.0], [1.0]])
    assert not certificate.valid
    assert set(certificate.pair) == {"tip", "wall"}
    np.testing.assert_allclose(certificate.where, 0.5, atol=0.005)


def test_what_only_our_own_distance_sees_is_refused_and_named():
    """C MuJoCo's capsule-box routine misses a rod straight through a thin sheet."""
    scene = Scene.from_mjcf(THIN.format('type="capsule" size=".005 .2" euler="0 90 0"'))
    world = make_world(scene)
    assert clearance_mujoco(scene, world, np.array([0.5])) > -0.001
    certificate = certify(scene, world, [[0.45], [0.55]])
    assert not certificate.valid
    assert set(certificate.pair) == {"tip", "wall"}
    assert certificate.reason.endswith("by jaxplan")
    pair, depth = closest_pair(scene, world, [0.5])
    assert set(pair) == {"tip", "wall"}
    assert depth < -0.005


def test_mug_scene_names_what_meets():
    scene = Scene.from_mjcf(build("planning"))
    low = PANDA.q_home + np.array([0, 1.2, 0, 0, 0, 0, 0])
    assert not certify(scene, make_world(scene), [PANDA.q_home, low]).valid
    far = make_world(scene, [[-2, 0, 0.0475, 1, 0, 0, 0]])
    certificate = certify(scene, far, [PANDA.q_home, low])
    assert not certificate.valid
    assert "table_planning" in certificate.pair
    pair, depth = closest_pair(scene, far, low)
    assert "table_planning" in pair
    assert depth < -0.001
    assert closest_pair(scene, make_world(scene), PANDA.q_home, reach=0.001)[0] is None


def test_a_held_mug_is_carried_by_the_hand():
    scene = Scene.from_mjcf(build("planning"))
    below = make_world(scene, [[0, 0, 0.6, 1, 0, 0, 0]], held=[True])
    (table, mug), depth = closest_pair(scene, below, PANDA.q_home)
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
    text = """<mujoco><worldbody>
      <body name="base"><geom size=".1"/><body name="a"><joint name="a"/>
        <geom size=".01"/><body name="b" pos="0 0 .05"><joint name="b"/>
          <geom size=".01" pos="0 0 .04"/>
          <body name="palm" pos="0 0 .3"><geom size=".01"/>
            <body name="left"><joint name="left" type="slide"/>
              <geom size=".01" pos=".1 0 0"/></body>
            <body name="right"><joint name="right" type="slide"/>
              <geom size=".01" pos="-.1 0 0"/></body>
      </body></body></body></body></worldbody></mujoco>"""
    scene = Scene.from_mjcf(text, exclude=None)
    assert scene.joints == ("a", "b")
    found = dict(always_touching(scene))
    # A link on a base that does not move is no child of it to MuJoCo's filter.
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

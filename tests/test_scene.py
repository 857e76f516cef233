import mujoco
import numpy as np
import pytest

from jaxplan.scene import Scene
from jaxplan.tasks.mug.scene import build


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(build("planning"))


def test_arm_gripper_hand_and_objects_are_found(scene: Scene):
    assert scene.joints == tuple(f"joint{i}" for i in range(1, 8))
    assert scene.passive == ("finger_joint1", "finger_joint2")
    assert scene.hand == "hand"
    assert scene.objects == ("mug",)
    np.testing.assert_allclose(scene.q_min[3], -3.0718)
    np.testing.assert_allclose(scene.q_max[5], 3.7525)


def test_pairs_are_those_that_mujoco_reports_when_everything_is_in_reach(scene: Scene):
    model = build("planning")
    model.geom_margin[:] = model.body_margin[:] = 10
    data = mujoco.MjData(model)
    data.qpos[:7] = [0.3, -0.3, 0.2, -2.0, 0.1, 1.8, 0.5]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    reported = {frozenset(map(int, pair)) for pair in data.contact.geom}
    table = scene.group_table()
    ours = {frozenset(map(int, pair)) for pair in np.argwhere(table >= 0)}
    # What no joint and no held object moves (link0 on the mug) is no question for q.
    assert ours == reported
    assert len(scene.pairs) == len(ours)


def test_filter_knows_excludes_parents_welds_and_explicit_pairs():
    scene = Scene.from_mjcf("""
      <mujoco><worldbody>
        <geom name="floor" type="plane" size="1 1 1"/>
        <body name="a" pos="0 0 1"><joint name="ja"/><geom name="a" size=".1"/>
          <body name="weld"><geom name="weld" size=".1"/></body>
          <body name="b" pos="0 0 1"><joint name="jb"/><geom name="b" size=".1"/>
            <body name="c" pos="0 0 1"><joint name="jc"/><geom name="c" size=".1"/>
              <body name="d"><joint name="jd"/>
                <geom name="d" size=".1" contype="0" conaffinity="0"/></body>
            </body></body></body>
      </worldbody><contact>
        <exclude body1="a" body2="c"/><pair geom1="d" geom2="a"/>
      </contact></mujoco>""")
    pairs = {frozenset(pair[1:]) for pair in scene.pairs}
    expected = "a-floor b-floor c-floor weld-floor weld-c d-a"
    assert pairs == {frozenset(pair.split("-")) for pair in expected.split()}


def test_joints_default_to_the_chain_before_the_tree_branches():
    xml = """<mujoco><worldbody><body name="base"><joint name="j0"/><geom size=".1"/>
      <body name="wrist"><joint name="j1"/><geom size=".1"/><body name="palm">
      <geom size=".1"/><body><joint name="f0" type="slide"/><geom size=".1"/></body>
      <body><joint name="f1" type="slide"/><geom size=".1"/></body></body></body>
      </body></worldbody></mujoco>"""
    scene = Scene.from_mjcf(xml)
    assert (scene.joints, scene.passive) == (("j0", "j1"), ("f0", "f1"))
    assert scene.hand == "palm"
    assert Scene.from_mjcf(xml, joints=["j1"]).passive == ("j0", "f0", "f1")


def test_unknown_names_are_refused_with_a_suggestion(scene: Scene):
    with pytest.raises(ValueError, match=r"did you mean 'hand\|mug'"):
        scene.ignored(["hnd|mug"])
    with pytest.raises(ValueError, match="no joint 'joint9': did you mean"):
        Scene.from_mjcf(scene.mj_model, joints=["joint9"])


def test_group_names_do_not_depend_on_order(scene: Scene):
    mask = scene.ignored(["mug|hand"])
    np.testing.assert_array_equal(mask, scene.ignored(["hand|mug"]))
    assert mask.sum() == 1

from collections.abc import Sequence

import mujoco
import numpy as np
import pytest

from jaxplan.planner import Planner
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


def test_bodies_without_names_keep_groups_of_their_own():
    scene = Scene.from_mjcf(
        """<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
        <body pos="1 0 1"><joint name="door"/><geom size=".1"/></body>
        <body pos="0 0 .5"><joint name="j"/><geom name="arm" size=".1"/></body>
        </worldbody></mujoco>""",
        joints=["j"],
    )
    assert {group.name for group in scene.groups} == {"body2|world", "body1|body2"}
    assert {frozenset(pair[1:]) for pair in scene.pairs} == {
        frozenset({"arm", "floor"}),
        frozenset({"arm", "body1[0]"}),
    }
    assert scene.ignored(["world|body2"]).sum() == 1
    assert scene.hand == "body2"


def test_joints_without_names_are_called_by_id():
    xml = """<mujoco><worldbody><body><freejoint/><geom size=".1"/></body>
      <body name="joint3" pos="0 0 1"><joint range="-1 1"/><geom size=".1"/>
      <body pos="0 0 1"><joint name="joint3"/><geom size=".1"/>
      <body pos="0 0 1"><joint/><geom size=".1"/></body></body></body>
      </worldbody></mujoco>"""
    scene = Scene.from_mjcf(xml)
    assert scene.joints == ("joint1", "joint3", "joint3_")
    assert scene.objects == ("body1",)
    np.testing.assert_allclose(scene.q_max, [np.deg2rad(1), np.inf, np.inf])
    assert Scene.from_mjcf(xml, joints=["joint1"]).passive == ("joint3", "joint3_")


def body(name: str, inside: str = "", joint: str = "hinge") -> str:
    """A body with a joint of its own name."""
    return (
        f'<body name="{name}" pos="0 0 .3"><joint name="{name}" type="{joint}"/>'
        f'<geom size=".05"/>{inside}</body>'
    )


def model(*bodies: str) -> str:
    return f"<mujoco><worldbody>{''.join(bodies)}</worldbody></mujoco>"


ARM = body("a", body("b", body("c", "{hand}")))


@pytest.mark.parametrize(
    ("hand", "joints"),
    [
        ("", "abc"),
        (body("gripper"), "abc"),
        (body("Left_Jaw"), "abc"),
        (body("d"), "abcd"),
        (body("gripper_roll", body("f") + body("g")), ["a", "b", "c", "gripper_roll"]),
        (body("f", body("g")) + body("h"), "abc"),
        # A base with an arm and a head on it.
        (body("d", body("e", body("f", body("g")))) + body("head"), "abcdefg"),
    ],
)
def test_the_arm_goes_down_to_its_hand(hand: str, joints: Sequence[str]):
    scene = Scene.from_mjcf(model(body("drawer"), ARM.format(hand=hand)))
    assert scene.joints == tuple(joints)


def test_several_longest_chains_are_listed():
    other = body("d", body("e", body("f")))
    text = model(ARM.format(hand=body("finger")), body("d", body("e", body("g"))))
    assert Scene.from_mjcf(text).joints == ("a", "b", "c")
    with pytest.raises(ValueError, match=r"joints=\[\.\.\.\].* a, b, c; d, e, f$"):
        Scene.from_mjcf(model(ARM.format(hand=""), other))
    torso = body("torso", ARM.format(hand="") + other)
    with pytest.raises(ValueError, match=r"torso, a, b, c; torso, d, e, f$"):
        Scene.from_mjcf(model(torso))


def test_the_hand_is_that_of_the_joints_that_are_given():
    palm = f'<body name="palm"><body name="left">{body("f")}</body>{body("g")}</body>'
    text = model(ARM.format(hand=palm), body("d", body("e", '<body name="tip"/>')))
    assert Scene.from_mjcf(text).hand == "palm"
    assert Scene.from_mjcf(text, joints=["d", "e"]).hand == "e"
    assert Scene.from_mjcf(text, joints=["a", "b"]).hand == "b"
    assert Scene.from_mjcf(text, joints=["d", "e"], hand="tip").hand == "tip"
    with pytest.raises(ValueError, match="'d' is given twice"):
        Scene.from_mjcf(text, joints=["d", "d"])


def test_a_ball_joint_in_the_arm_is_named():
    text = model(body("a", body("shoulder", body("c"), joint="ball")))
    with pytest.raises(ValueError, match="ball joint 'shoulder' is not supported"):
        Scene.from_mjcf(text)
    with pytest.raises(ValueError, match="'shoulder' is neither a hinge nor a slide"):
        Scene.from_mjcf(text, joints=["shoulder"])


SILENT = """<mujoco><worldbody>
  <geom name="post" size=".1" contype="0" conaffinity="0"/>
  <body name="a" pos="0 0 .22"><joint name="j" type="slide" axis="0 0 1"/>
    <geom name="g" size=".1" contype="0" conaffinity="0"/>
    <geom name="visual" size=".2" contype="0" conaffinity="0"/></body>
</worldbody><contact><pair geom1="post" geom2="g"/></contact></mujoco>"""


def test_slots_can_touch_geoms_that_only_an_explicit_pair_names():
    scene = Scene.from_mjcf(SILENT, slots={"box": 1, "sphere": 1})
    pairs = {frozenset(pair[1:]) for pair in scene.pairs}
    assert pairs == {frozenset({"g", other}) for other in ("post", "box0", "sphere0")}


def test_a_body_of_the_model_is_never_taken_for_slots():
    text = model(body("a"), '<body name="obstacles"><geom size=".1"/></body>')
    assert Scene.from_mjcf(text).slots == ()
    with pytest.raises(ValueError, match="the name 'obstacles'"):
        Scene.from_mjcf(text, slots={"box": 1})


def test_a_file_that_cannot_be_read_is_named_in_one_line(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no such file: .*robot\.xml"):
        Scene.from_mjcf(tmp_path / "robot.xml")
    for number, text in enumerate(("<mujoco><worldbody", model("<body nam='a'/>"))):
        file = tmp_path / f"{number}.xml"
        file.write_text(text)
        with pytest.raises(ValueError, match=rf"{number}\.xml: .*[lL]ine") as error:
            Scene.from_mjcf(file)
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("arm", "element"),
    [
        ('<body name="a" pos="0 nan 0"><joint/><geom size="1"/></body>', "body 'a'"),
        ('<body><joint/><geom name="g" pos="inf 0 0" size="1"/></body>', "geom 'g'"),
        ('<body><joint axis="nan 0 1"/><geom size="1"/></body>', "joint 'joint0'"),
        ('<body><joint ref="nan" name="j"/><geom size="1"/></body>', "joint 'j'"),
    ],
)
def test_numbers_that_are_not_finite_are_named(arm: str, element: str):
    with pytest.raises(ValueError, match=f"{element} has .* not finite"):
        Scene.from_mjcf(model(arm))


def test_joints_without_limits_are_planned_for():
    arm = ARM.format(hand="").replace('type="hinge"', 'axis="0 1 0"')
    scene = Scene.from_mjcf(model('<geom name="post" pos=".65 0 .3" size=".15"/>', arm))
    np.testing.assert_array_equal(scene.q_min, [-np.inf] * 3)
    np.testing.assert_array_equal(scene.q_max, [np.inf] * 3)
    planner = Planner(scene)
    # From straight up to straight down: the arm folds to pass the post.
    plan = planner.plan([0.0, 0.0, 0.0], [3.1, 0.0, 0.0])
    assert plan.solved
    assert planner.certify(plan).valid
    assert not planner.certify([[0.0, 0.0, 0.0], [3.1, 0.0, 0.0]]).valid
    out = planner.plan([0.0, 0.0, 0.0], [6.5, 0.0, 0.0])
    assert out.status.name == "OUT_OF_LIMITS"

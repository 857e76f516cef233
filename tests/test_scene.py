from collections.abc import Sequence

import jax
import mujoco
import numpy as np
import pytest

from jaxplan.collision import (
    XLA_OPTIONS,
    Obstacle,
    clearance,
    clearance_mujoco,
    make_world,
    world_at_key,
)
from jaxplan.motion import Planner
from jaxplan.scene import Scene
from jaxplan.tasks.mug.scene import build

fast_clearance = jax.jit(clearance, compiler_options=XLA_OPTIONS)


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


def sphere(name: str, pos: str, inside: str = "", joint: str = "") -> str:
    """A body with a small sphere that has its name."""
    return f'<body name="{name}" pos="{pos}">{joint}<geom size=".1"/>{inside}</body>'


HINGE = '<joint axis="0 1 0"/>'


def test_bodies_whose_names_have_bars_can_be_ignored():
    bodies = sphere("a|b", "0 0 1", joint=HINGE) + sphere("c", "1 0 1")
    scene = Scene.from_mjcf(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    for pair in ("a|b|c", "c|a|b", ("a|b", "c"), ["c", "a|b"]):
        assert scene.ignored([pair]).tolist() == [True]
    for wrong in ("a|c", "a|b", "c", ("a", "c"), ("c",), "", ("a|b", "c", "c"), (1, 2)):
        with pytest.raises(
            ValueError, match=r"^no (contact group|body)|no pair of bod"
        ):
            scene.ignored([wrong])


def test_names_that_can_be_read_in_two_ways_need_a_tuple():
    bodies = "".join(
        sphere(name, f"{x} 0 1", joint=HINGE)
        for x, name in enumerate(("a", "a|b", "b|c", "c"))
    )
    scene = Scene.from_mjcf(
        f"<mujoco><worldbody>{bodies}</worldbody></mujoco>", joints=["joint0", "joint1"]
    )
    names = [group.name for group in scene.groups]
    assert names.count("a|b|c") == 2
    with pytest.raises(ValueError, match=r"may be \('a', 'b\|c'\) or .*give a tuple"):
        scene.ignored(["a|b|c"])
    first, second = (scene.ignored([p]) for p in (("a", "b|c"), ("c", "a|b")))
    assert first.sum() == second.sum() == 1
    assert not (first & second).any()


def test_pairs_that_are_not_checked_may_be_ignored(scene: Scene):
    assert not scene.ignored(["left_finger|right_finger", ("world", "link0")]).any()


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
    around = planner.plan([0.0, 0.0, 0.0], [6.5, 0.0, 0.0])
    assert around.length == pytest.approx(6.5 - 2 * np.pi, abs=1e-3)


def test_a_scene_is_one_line(scene: Scene):
    assert repr(scene) == (
        f"Scene(joints: joint1, ..., joint7; objects: mug; {len(scene.pairs)} pairs; 0 slots)"
    )
    assert len(repr(scene.structure)) < 100


GRIPPER = sphere("left", ".15 0 .1", joint='<joint name="l" type="slide"/>') + sphere(
    "right", "-.05 0 .1", joint='<joint name="r" type="slide"/>'
)


def test_what_no_joint_of_the_arm_changes_is_not_checked():
    hand = sphere("hand", "0 0 .4", GRIPPER, '<joint name="b"/>')
    mug = sphere("lid", ".05 0 0", "", "<joint/>") + sphere(
        "spoon", "0 0 0", "", "<joint/>"
    )
    text = model(
        sphere("arm", "0 0 .5", hand, '<joint name="a"/>'),
        sphere("mug", "1 0 0", mug, "<freejoint/>"),
        sphere("box", "2 0 0", "", "<freejoint/>"),
        sphere("table", "3 0 0"),
    )
    scene = Scene.from_mjcf(text, joints=["a", "b"])
    groups = {group.name: group.held for group in scene.groups}
    # The fingers overlap, and so do the mug's lid and spoon.
    assert "left|right" not in groups
    assert "lid|spoon" not in groups
    assert groups["arm|mug"] == groups["left|mug"] == groups["left|lid"] == ()
    assert groups["lid|table"] == groups["mug|table"] == (0,)
    assert groups["box|lid"] == groups["box|mug"] == (0, 1)
    # One joint of the arm lies between the arm and the fingers.
    assert groups["arm|left"] == ()
    assert "arm|hand" not in groups


@pytest.mark.parametrize("named", ["arm", "finger"])
def test_fingers_that_overlap_leave_the_arm_free(named: str):
    hand = sphere("hand", "0 0 .4", GRIPPER, '<joint name="b"/>')
    text = model(sphere("arm", "0 0 .5", hand, '<joint name="a"/>'))
    joints = {"arm": ["a", "b"], "finger": ["a", "b", "l"]}[named]
    scene = Scene.from_mjcf(text, joints=joints)
    assert any(group.name == "left|right" for group in scene.groups) == (
        named == "finger"
    )
    assert Scene.from_mjcf(text, joints=["a"]).groups == ()


ON_A_BASE = model(
    sphere(
        "base",
        "0 0 1",
        sphere("link", ".3 0 0", sphere("hand", ".3 0 0", "", HINGE), HINGE),
        "<freejoint/>",
    ),
    sphere("mug", "2 0 0", "", "<freejoint/>"),
    '<geom name="floor" type="plane" size="9 9 1"/>',
)


def test_a_floating_base_stands_where_the_world_puts_it():
    scene = Scene.from_mjcf(ON_A_BASE)
    assert (scene.objects, scene.bases) == (("base", "mug"), ("base",))
    rng = np.random.default_rng(0)
    q = rng.uniform(-3, 3, (20, 2))
    base, in_hand = [1, 2, 0.6, 0.8, 0, 0.6, 0], [0.2, 0, 0.1, 0.6, 0.8, 0, 0]
    # What hangs on the base carries the mug along, wherever the base is.
    for pose, held in ((base, [False, True]), (base, [False, False])):
        world = make_world(scene, [pose, in_hand], held, ignored=["hand|mug"])
        expected = clearance_mujoco(scene, world, q, reach=9.0)
        np.testing.assert_allclose(fast_clearance(scene, world, q), expected, atol=1e-5)
    with pytest.raises(ValueError, match="'base' cannot be held, the arm hangs on it"):
        make_world(scene, held=[True, False])
    with pytest.raises(ValueError, match="'base' cannot be held"):
        make_world(scene, held=[[False, True], [True, True]])
    assert jax.jit(lambda held: make_world(scene, held=held).held)(
        np.array([True, False])
    ).any()


def test_an_arm_on_a_mocap_body_goes_with_it():
    link = sphere("link", ".3 0 0", sphere("hand", ".3 0 0", "", HINGE), HINGE)
    cart = f'<body name="cart" mocap="true"><geom size=".1"/>{link}</body>'
    scene = Scene.from_mjcf(model(cart, sphere("mug", "2 0 .3", "", "<freejoint/>")))
    q = np.random.default_rng(0).uniform(-3, 3, (20, 2))
    mug, cart = [0.2, 0, 0.1, 0.6, 0.8, 0, 0], [1, 2, 0.6, 0.8, 0, 0.6, 0]
    world = make_world(scene, [mug, cart], [True, False], ignored=["hand|mug"])
    expected = clearance_mujoco(scene, world, q, reach=9.0)
    np.testing.assert_allclose(clearance(scene, world, q), expected, atol=1e-5)
    assert scene.bases == ("cart",)
    with pytest.raises(ValueError, match="cannot be held"):
        make_world(scene, held=[False, True])


def test_both_arms_are_planned_together():
    def side(n: str, x: str) -> str:
        hand = f'<body name="palm{n}">{body(f"f{n}")}{body(f"g{n}")}</body>'
        return sphere(
            f"l{n}", x, body(f"a{n}", body(f"b{n}", hand)), f'<joint name="{n}"/>'
        )

    wheels = "".join(
        f'<joint name="{axis}" type="slide" axis="{way}" ref=".3"/>'
        for axis, way in (("x", "1 0 0"), ("y", "0 1 0"))
    )
    text = model(
        sphere("base", "0 0 .1", side("0", "0 .3 0") + side("1", "0 -.3 0"), wheels)
    )
    with pytest.raises(ValueError, match="which joints are the arm"):
        Scene.from_mjcf(text)
    joints = [name + n for n in "01" for name in ("", "a", "b")]
    scene = Scene.from_mjcf(text, joints=joints)
    assert scene.joints == tuple(joints)
    assert scene.passive == ("x", "y", "f0", "g0", "f1", "g1")
    np.testing.assert_allclose(make_world(scene).passive, [0.3, 0.3, 0, 0, 0, 0])
    assert scene.hand == "palm1"
    names = {group.name for group in scene.groups}
    assert {"b0|b1", "a1|f0"} <= names
    assert not {"f0|g0", "base|base"} & names
    whole = Scene.from_mjcf(text, joints=["x", "y", *joints])
    q = np.random.default_rng(0).uniform(-2, 2, (10, 8))
    still = np.concatenate([np.full((10, 2), 0.3), q[:, 2:]], -1)
    world = make_world(scene)
    np.testing.assert_allclose(
        clearance_mujoco(whole, make_world(whole), still, 9.0),
        clearance_mujoco(scene, world, q[:, 2:], 9.0),
    )
    np.testing.assert_allclose(
        fast_clearance(scene, world, q[:, 2:]),
        clearance_mujoco(scene, world, q[:, 2:], 9.0),
        atol=1e-5,
    )


def cloth(pos: str, bits: int) -> str:
    return (
        f'<flexcomp name="cloth" type="grid" dim="2" count="3 3 1" spacing=".1 .1 .1" '
        f'pos="{pos}" mass="1"><edge equality="true"/>'
        f'<contact contype="{bits}" conaffinity="{bits}" selfcollide="none"/></flexcomp>'
    )


FLEX_SCENE = (
    '<geom name="floor" type="plane" size="9 9 1" contype="12" conaffinity="12"/>'
    '<body name="mug" pos="1 0 0"><freejoint/><geom size=".1" contype="2"/></body>'
    '<body name="a" pos="0 0 .5"><joint name="a"/>{inside}'
    '<geom name="a" pos=".3 0 0" size=".1" contype="5"/></body>{cloth}'
)


@pytest.mark.parametrize(
    ("bits", "inside", "refused"),
    [
        (0, False, False),
        (1, False, True),
        (8, False, False),  # the floor alone
        (2, False, True),  # the mug, which may be held
        (8, True, True),  # the arm carries it over the floor
        (0, True, False),
    ],
)
def test_flexes_are_refused_only_where_they_can_be_touched(bits, inside, refused):
    # In the way of the arm, and where MuJoCo leaves the vertices without mj_flex.
    soft = cloth("0 0 0", bits)
    text = FLEX_SCENE.format(
        inside=soft if inside else "", cloth="" if inside else soft
    )
    if refused:
        with pytest.raises(ValueError, match="flex 'cloth' is a deformable body"):
            Scene.from_mjcf(model(text), joints=["a"])
        return
    scene = Scene.from_mjcf(model(text), joints=["a"])
    q = np.linspace(-3, 3, 10)[:, None]
    world = make_world(scene)
    np.testing.assert_allclose(
        clearance_mujoco(scene, world, q, reach=9.0),
        fast_clearance(scene, world, q),
        atol=1e-5,
    )


KEYED = model(
    '<body name="a"><joint name="a"/><geom name="a" pos=".5 0 0" size=".1"/></body>'
    '<body name="g" pos="0 0 9"><joint name="g"/><geom size=".1"/></body>',
    '<body name="mug" pos="3 0 0"><freejoint/><geom size=".1"/></body>',
    '<body name="m1" mocap="true" pos="0 5 0"><geom size=".1"/></body>'
    '<body name="m2" mocap="true" pos="0 6 0"><geom size=".1"/></body>',
).replace(
    "</mujoco>",
    '<keyframe><key name="k" qpos=".1 .2 2 2 2 0 0 0 0" mpos="0 5 0 .6 0 .1" '
    'mquat="0 0 0 0 0 1 0 0"/></keyframe></mujoco>',
)


def test_a_key_frame_places_mocap_bodies_too():
    scene = Scene.from_mjcf(KEYED, joints=["a"])
    world = world_at_key(scene, "k")
    poses = [
        [2, 2, 2, 1, 0, 0, 0],
        [0, 5, 0, 1, 0, 0, 0],
        [0.6, 0, 0.1, 0, 1, 0, 0],
    ]
    np.testing.assert_allclose(world.object_pose, poses)
    np.testing.assert_allclose(world.passive, [0.2])
    data = mujoco.MjData(scene.mj_model)
    mujoco.mj_resetDataKeyframe(scene.mj_model, data, 0)
    mujoco.mj_forward(scene.mj_model, data)
    deepest = min(contact.dist for contact in data.contact)
    for distance in (fast_clearance, clearance_mujoco):
        got = distance(scene, world, np.array([0.1]))
        np.testing.assert_allclose(got, deepest, atol=1e-6)
    for wrong in ("kk", 1, -1):
        with pytest.raises(ValueError, match="no key frame"):
            world_at_key(scene, wrong)


def test_quaternions_of_zeros_turn_nothing():
    spec = mujoco.MjSpec.from_string(KEYED)
    for name in ("a", "mug", "m1", "m2"):
        spec.body(name).quat = [0, 0, 0, 0]
    scene = Scene.from_mjcf(spec, joints=["a"])
    world = make_world(scene)
    np.testing.assert_array_equal(world.object_pose[:, 3:], [[1, 0, 0, 0]] * 3)
    distance = fast_clearance(scene, world, np.array([0.1]))
    expected = clearance_mujoco(scene, world, np.array([0.1]), reach=9.0)
    np.testing.assert_allclose(distance, expected, atol=1e-5)
    assert distance > 1


def test_quaternions_of_zeros_that_mujoco_takes_for_something_else_are_named():
    text = model(sphere("a", "0 0 1", sphere("b", "0 0 1"), HINGE))
    spec = mujoco.MjSpec.from_string(text)
    spec.body("b").quat = [0, 0, 0, 0]
    with pytest.raises(ValueError, match=r"body 'b' has quat \[0, 0, 0, 0\]"):
        Scene.from_mjcf(spec)
    spec = mujoco.MjSpec.from_string(text)
    spec.geoms[1].quat = [0, 0, 0, 0]
    with pytest.raises(ValueError, match="geom 'geom1' has quat"):
        Scene.from_mjcf(spec)


POSE = (0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("kind", "count"),
    [("sphere", 1), ("capsule", 2), ("cylinder", 2), ("ellipsoid", 3), ("box", 3)],
)
def test_obstacles_that_make_no_sense_are_refused(
    slotted: Scene, kind: str, count: int
):
    good = [0.1] * count
    assert make_world(slotted, obstacles=[Obstacle(kind, good, POSE)]) is not None
    sizes = [
        0.1,
        None,
        "big",
        "0.1",
        [0.1] * (count + 1),
        [],
        [good],
        {},
        [None] * count,
    ]
    sizes += [
        [*good[1:], wrong] for wrong in (np.nan, np.inf, 0.0, -0.1, "x", 1e300, 1j)
    ]
    for size in sizes:
        with pytest.raises(ValueError, match=rf"^{kind} has size .*expected .*\[m\]$"):
            make_world(slotted, obstacles=[Obstacle(kind, size, POSE)])
    poses = [0.1, None, "here", (0, 0), (0, 0, np.nan), [POSE], (0,) * 8, (0, 0, 1, 1)]
    poses += [(0, 0, 1, 0, 0, 0, 0), (0, 0, 1, np.inf, 0, 0, 0), ("x", 0, 0)]
    for pose in poses:
        with pytest.raises(
            ValueError, match=rf"^{kind} has pose .*expected a position"
        ):
            make_world(slotted, obstacles=[Obstacle(kind, good, pose)])
    with pytest.raises(ValueError, match="no slot is left"):
        make_world(slotted, obstacles=[Obstacle(kind, good, POSE)] * 2)


@pytest.fixture(scope="module")
def slotted() -> Scene:
    kinds = ("sphere", "capsule", "cylinder", "ellipsoid", "box")
    return Scene.from_mjcf(model(body("a")), slots=dict.fromkeys(kinds, 1))


@pytest.mark.parametrize(
    ("obstacle", "line"),
    [
        (
            Obstacle("boxx", [0.1] * 3, POSE),
            "no kind of slot 'boxx': did you mean 'box'",
        ),
        (
            Obstacle("mesh", [0.1], POSE),
            "no kind of slot 'mesh': there are sphere, ",
        ),
        (Obstacle(3, [0.1], POSE), "no kind of slot '3'"),
        (("box", [0.1] * 3, POSE), "is no Obstacle"),
        (None, "is no Obstacle"),
    ],
)
def test_unknown_obstacles_are_refused(slotted: Scene, obstacle, line: str):
    with pytest.raises(ValueError, match=line):
        make_world(slotted, obstacles=[obstacle])


@pytest.mark.parametrize(
    ("field", "given", "line"),
    [
        ("passive", [0.1], r"\[..., 2\] for finger_joint1, finger_joint2"),
        ("passive", 0.1, r"passive has shape \(\)"),
        ("held", [True, False], r"held has shape \(2,\), expected \[..., 1\] for mug"),
        ("object_pose", [0, 0, 1, 1, 0, 0, 0], r"expected \[..., 1, 7\] for mug"),
    ],
)
def test_worlds_of_the_wrong_shape_are_refused(scene: Scene, field, given, line):
    with pytest.raises(ValueError, match=line):
        make_world(scene, **{field: given})

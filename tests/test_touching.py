"""What is left out by default, what never is, and what a margin does not count."""

from collections import Counter

import mujoco
import numpy as np
import pytest

from jaxplan.collision import clearance_mujoco, make_world
from jaxplan.collision.oracle import contacts_of
from jaxplan.scene import Scene
from jaxplan.scene.contacts import find_contacts, geom_pairs

ARM = """
<mujoco>
  <worldbody>
    {world}
    <body name="base" pos="0 0 .1">
      <geom name="base" type="cylinder" size=".08 .1"/>
      <body name="l1" pos="0 0 .1"><joint name="j1" axis="0 0 1" range="-3 3"/>
        <geom name="l1" type="capsule" size=".05" fromto="0 0 {low} 0 0 .11"/>
        <body name="l2" pos="0 0 .15"><joint name="j2" axis="0 1 0" range="-2 2"/>
          <geom name="l2" type="capsule" size=".04" fromto="0 0 .05 0 0 .3"/>
          <body name="l3" pos="0 0 .35"><joint name="j3" axis="0 1 0" range="-2 2"/>
            <geom name="l3" type="capsule" size=".04" fromto="0 0 .05 0 0 .2"/>
            <body name="l4" pos="0 0 .25"><joint name="j4" axis="0 0 1" range="-3 3"/>
              <geom name="l4" type="sphere" size=".03"/>{hand}
            </body></body></body></body></body>
  </worldbody>{rest}
</mujoco>"""


def arm(world: str = "", hand: str = "", rest: str = "", low: float = 0.06) -> str:
    """Base and four links; the lower `low`, the deeper the first is in the base."""
    return ARM.format(world=world, hand=hand, rest=rest, low=low)


def pairs(scene: Scene) -> set[frozenset[str]]:
    return {frozenset(pair[1:]) for pair in scene.pairs}


def left_out(scene: Scene) -> set[frozenset[str]]:
    return {frozenset(row[:2]) for row in scene.excluded}


def test_what_always_overlaps_is_left_out_and_nothing_else():
    text = arm('<geom name="floor" type="plane" size="1 1 1"/>', low=0)
    scene, whole = Scene.from_mjcf(text), Scene.from_mjcf(text, exclude=None)
    assert left_out(scene) == {frozenset({"base", "l1"})}
    assert scene.excluded[0].why == "touch in 100 % of random poses"
    assert whole.excluded == ()
    assert pairs(whole) - pairs(scene) == left_out(scene)
    q = np.zeros((1, 4))
    assert clearance_mujoco(whole, make_world(whole), q) < 0
    assert clearance_mujoco(scene, make_world(scene), q, reach=1.0) > 0


@pytest.mark.parametrize("depth", [0.0, -5e-5, 5e-5])
def test_surfaces_that_lie_on_each_other_touch(depth: float):
    scene = Scene.from_mjcf(arm(low=0.05 - depth))
    assert left_out(scene) == {frozenset({"base", "l1"})}


def test_neighbours_that_nearly_always_touch_are_left_out():
    flange = '<geom name="flange" size=".073" pos=".1 0 -.25"/>'
    scene = Scene.from_mjcf(arm(hand=flange))
    (why,) = (row.why for row in scene.excluded if set(row[:2]) == {"flange", "l2"})
    assert 70 < float(why.split()[2]) < 100
    # l1 has two bodies between, the base three: such contacts are the question's.
    assert {frozenset({"flange", other}) for other in ("l1", "base")} <= pairs(scene)


def test_shares_are_those_of_other_random_poses():
    """Robots at random, whose shapes overlap much."""
    rng = np.random.default_rng(0)
    seen = Counter()
    for _ in range(20):
        shapes = [
            f'<geom name="g{i}" type="capsule" size="{rng.uniform(0.03, 0.12)}" '
            f'fromto="0 0 0 {rng.uniform(-0.1, 0.1)} 0 {rng.uniform(0, 0.3)}"/>'
            for i in range(5)
        ]
        text = shapes[-1]
        for i in (3, 2, 1):
            text = (
                f'<body pos="0 0 .1"><joint name="j{i}" axis="0 {i % 2} {1 - i % 2}" '
                f'range="-2 2"/>{shapes[i]}{text if i < 3 else ""}</body>'
            )
        text = f'<body name="base">{shapes[0]}{text}</body>{shapes[-1]}'
        scene = Scene.from_mjcf(
            f'<mujoco><compiler angle="radian"/><worldbody>{text}</worldbody></mujoco>'
        )
        whole = Scene.from_mjcf(scene.mj_model, exclude=None)
        q, touches = rng.uniform(-2, 2, (300, 3)), Counter()
        for _, geoms in contacts_of(whole, make_world(whole), q):
            touches.update(
                frozenset(map(whole.geom_name, pair)) for pair in geoms.tolist()
            )
        for _, a, b in whole.pairs:
            share, out = touches[frozenset({a, b})] / 300, {a, b} in left_out(scene)
            chain = {"g0", "g1", "g2", "g3"} >= {a, b}
            near = abs(int(a[1]) - int(b[1])) <= 2
            if share < 0.6 or (not chain and share < 0.97):
                assert not out
            if chain and (
                (share > 0.8 and near) or (share == 1 and "g0" not in {a, b})
            ):
                assert out
            seen[out] += 1
    assert min(seen.values()) >= 10


TABLE = '<geom name="table" type="box" size=".6 .6 {}" pos="0 0 {}"/>'


def test_a_wall_that_the_upper_arm_hits_in_nearly_all_poses_stays():
    wall = '<geom name="wall" type="box" size=".1 1 1" pos=".16 0 1"/>'
    bounds = ('axis="0 1 0" range="-2 2"', 'axis="0 1 0" range="-.04 2"')
    text = arm(wall).replace(*bounds).replace("-3 3", "-.01 .01")
    scene = Scene.from_mjcf(text)
    q = np.random.default_rng(1).uniform(
        [-0.01, -0.04, 0, 0], [0.01, 2, 0, 0], (200, 4)
    )
    hits = clearance_mujoco(scene, make_world(scene), q) < 0
    assert 0.9 < hits.mean() < 1
    assert scene.excluded == ()


def test_what_carries_the_arm_may_touch_its_first_link_but_is_seen_by_the_others():
    scene = Scene.from_mjcf(arm(TABLE.format(0.14, 0.14)))
    assert left_out(scene) == {frozenset({"table", "l1"})}
    assert {frozenset({"table", name}) for name in ("l2", "l3", "l4")} <= pairs(scene)


def test_a_hull_around_the_robot_is_never_left_out_for_the_hand():
    scene = Scene.from_mjcf(arm(TABLE.format(2, 2)))
    for name in ("l3", "l4"):
        assert frozenset({"table", name}) in pairs(scene)


def test_a_pose_in_a_key_frame_proves_nothing():
    """Folded, l4 is in l2; it must not fall through it."""
    rest = '<keyframe><key name="home" qpos="0 0 2.9 0"/></keyframe>'
    text = arm(rest=rest).replace(
        'axis="0 1 0" range="-2 2"', 'axis="0 1 0" range="-3 3"'
    )
    scene = Scene.from_mjcf(text)
    q = scene.mj_model.key("home").qpos[None]
    assert clearance_mujoco(scene, make_world(scene), q) < 0
    assert scene.excluded == ()


def test_objects_and_slots_are_never_left_out():
    """They always touch where they are, but a query may put them elsewhere."""
    world = (
        '<body name="cup" pos="0 0 .2"><freejoint/><geom name="cup" size=".1"/></body>'
        '<body name="box" mocap="true" pos="0 0 .2"><geom name="box" size=".1"/></body>'
    )
    scene = Scene.from_mjcf(arm(world), slots={"box": 1})
    assert scene.excluded == ()
    assert {frozenset({x, "l1"}) for x in ("cup", "box", "box0")} <= pairs(scene)


def test_a_joint_that_follows_another_follows_it_in_random_poses():
    """A telescope: both parts rise together, so that they always overlap."""
    text = """<mujoco><worldbody><body name="base"><geom name="base" size=".01"/>
      <body name="a"><joint name="a" type="slide" range="0 1"/>
        <geom name="a" size=".1"/></body>
      <body name="b"><joint name="b" type="slide" range="0 1"/>
        <geom name="b" size=".1"/></body></body></worldbody>{}</mujoco>"""
    tie = '<equality><joint joint1="a" joint2="b" polycoef="0 1 0 0 0"/></equality>'
    free, tied = (Scene.from_mjcf(text.format(x), joints=["b"]) for x in ("", tie))
    assert left_out(free) == set()
    assert left_out(tied) == {frozenset({"a", "b"})}


@pytest.mark.parametrize(
    "exclude",
    ["l1|l3", [["l3", "l1"]], ["l1|l3", "always_touching", "l1|l3"], {("l1", "l3")}],
)
def test_pairs_of_bodies_are_given_in_either_form(exclude):
    text = arm(low=0)
    scene, whole = (Scene.from_mjcf(text, exclude=e) for e in (exclude, None))
    found = {frozenset({"l1", "l3"})}
    if "always_touching" in exclude:
        found |= {frozenset({"base", "l1"})}
    assert left_out(scene) == found
    assert pairs(whole) - pairs(scene) == found


@pytest.mark.parametrize(
    ("exclude", "message"),
    [
        ("always", r"exclude 'always': say 'always_touching', 'body\|body' or"),
        ([("l1", "l2", "l3")], r"exclude \('l1', 'l2', 'l3'\): say"),
        (["a|b|c"], r"'a\|b\|c' is no pair of bodies"),
        (["l1|l33"], "no body 'l33': did you mean 'l3'"),
    ],
)
def test_what_means_nothing_is_refused(exclude, message: str):
    with pytest.raises(ValueError, match=message):
        Scene.from_mjcf(arm(), exclude=exclude)


def test_any_set_of_pairs_can_be_cut_out_of_the_rectangles():
    geoms = "".join(f'<geom size=".1" pos="0 0 {i}"/>' for i in range(4))
    bodies = "".join(f'<body><joint name="{b}"/>{geoms}</body>' for b in "abc")
    model = mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody>{geoms}{bodies}</worldbody></mujoco>"
    )

    def every(contacts):
        found = [tuple(sorted(p)) for c in contacts for p in geom_pairs(c)]
        assert len(found) == len(set(found))
        return set(found)

    whole, rng = every(find_contacts(model)), np.random.default_rng(0)
    for share in np.linspace(0, 1, 20):
        cut = {pair for pair in whole if rng.uniform() < share}
        assert every(find_contacts(model, cut)) == whole - cut


def test_numbers_that_are_replaced_leave_out_the_same():
    scene = Scene.from_mjcf(arm(low=0))
    turned = scene.replace(geom_quat=scene.model.geom_quat)
    assert turned.excluded == scene.excluded
    assert pairs(turned) == pairs(scene)


def test_neighbours_that_are_always_near_are_listed_with_their_distance():
    scene = Scene.from_mjcf(arm(low=0.0502))
    (pair,) = scene.structure.near
    assert {scene.geom_name(geom) for geom in pair} == {"base", "l1"}
    np.testing.assert_allclose(scene.structure.near[pair], 2e-4, atol=1e-6)
    assert Scene.from_mjcf(arm(low=0.1)).structure.near == {}

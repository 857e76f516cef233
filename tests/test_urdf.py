"""URDF and SRDF against MJCFs of the same robots, and what is wrong in them by name."""

import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest

from jaxplan.collision import clearance_mujoco, make_world
from jaxplan.scene import Scene

BOX = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
FACES = [
    *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
    *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
]


def write_stl(path: Path, half: tuple[float, float, float]) -> None:
    """A box, as binary STL."""
    path.parent.mkdir(parents=True, exist_ok=True)
    corners = BOX * half
    rows = [
        struct.pack("<12fH", 0, 0, 0, *corners[list(face)].ravel(), 0) for face in FACES
    ]
    path.write_bytes(bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows))


def shape(geometry: str, origin: str = "", name: str = "shape") -> str:
    return (
        f'<collision name="{name}">{origin}<geometry>{geometry}</geometry></collision>'
    )


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, kind: str, parent: str, child: str, inside: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{child}"/>{inside}</joint>'
    )


LIMITS = '<limit lower="-1" upper="2" effort="1" velocity="3"/>'
ROBOT = "".join(
    [
        '<?xml version="1.0"?><robot name="r">',
        '<mujoco><compiler fusestatic="true"/></mujoco>',
        link("world"),
        link("base", shape('<cylinder radius=".1" length=".2"/>')),
        link(
            "upper",
            '<visual><geometry><mesh filename="no.dae"/></geometry></visual>'
            + shape(
                '<mesh filename="package://arm/meshes/upper.stl"/>',
                '<origin xyz="0 0 .2" rpy=".1 .2 .3"/>',
            ),
        ),
        link("flange"),
        link(
            "lower",
            '<inertial><mass value="0"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" '
            'iyz="0" izz="0"/></inertial>' + shape('<box size=".1 .2 .3"/>'),
        ),
        link("finger", shape('<sphere radius=".02"/>')),
        link("mirror", shape('<sphere radius=".02"/>')),
        joint("fix", "fixed", "world", "base", '<origin xyz=".5 0 .1"/>'),
        joint("turn", "continuous", "base", "upper", '<axis xyz="0 0 1"/>'),
        joint(
            "stiff", "fixed", "upper", "flange", '<origin xyz="0 0 .4" rpy="1 0 0"/>'
        ),
        joint("tilt", "revolute", "flange", "lower", '<axis xyz="0 2 0"/>' + LIMITS),
        joint(
            "grip",
            "prismatic",
            "lower",
            "finger",
            '<origin xyz=".1 0 .2"/><axis xyz="1 0 0"/>' + LIMITS,
        ),
        joint(
            "follow",
            "prismatic",
            "lower",
            "mirror",
            '<origin xyz="-.1 0 .2"/><axis xyz="1 0 0"/>'
            '<limit lower="-9" upper="9" drake:x="1"/>'
            '<mimic joint="grip" multiplier="-.5" offset=".01"/>',
        ),
        "</robot>",
    ]
)
SAME = """
<mujoco><compiler angle="radian" eulerseq="XYZ"/>
  <asset><mesh name="upper" file="{}/arm/meshes/upper.stl" inertia="convex"/></asset>
  <worldbody><body name="base" pos=".5 0 .1"><geom type="cylinder" size=".1 .1"/>
    <body name="upper"><joint name="turn" axis="0 0 1"/>
      <geom type="mesh" mesh="upper" pos="0 0 .2" euler=".1 .2 .3"/>
      <body name="flange" pos="0 0 .4" euler="1 0 0">
        <body name="lower"><joint name="tilt" axis="0 1 0" range="-1 2"/>
          <geom type="box" size=".05 .1 .15"/>
          <body name="finger" pos=".1 0 .2">
            <joint name="grip" type="slide" axis="1 0 0" range="-1 2"/>
            <geom size=".02"/></body>
          <body name="mirror" pos="-.1 0 .2">
            <joint name="follow" type="slide" axis="1 0 0" range="-9 9"/>
            <geom size=".02"/></body>
        </body></body></body></body></worldbody>
  <equality><joint joint1="follow" joint2="grip" polycoef=".01 -.5 0 0 0"/></equality>
</mujoco>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_stl(tmp_path / "arm" / "meshes" / "upper.stl", (0.05, 0.08, 0.2))
    (tmp_path / "arm" / "urdf").mkdir()
    (tmp_path / "arm" / "urdf" / "arm.urdf").write_text(ROBOT)
    return tmp_path


@pytest.fixture
def urdf(folder: Path) -> Path:
    return folder / "arm" / "urdf" / "arm.urdf"


def test_a_urdf_is_the_robot_that_an_mjcf_says(folder: Path, urdf: Path):
    scene = Scene.from_urdf(urdf, exclude=None)
    same = Scene.from_mjcf(SAME.format(folder), exclude=None)
    assert scene.joints == same.joints == ("turn", "tilt")
    assert scene.structure.body_names == same.structure.body_names
    assert {pair[0] for pair in scene.pairs} == {pair[0] for pair in same.pairs}
    assert len(scene.pairs) == len(same.pairs)
    np.testing.assert_array_equal(scene.q_max, [np.inf, 2])
    q = np.random.default_rng(0).uniform(-1, 1, (100, 2))
    ours, theirs = (
        clearance_mujoco(s, make_world(s), q, reach=1.0) for s in (scene, same)
    )
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    model, other = scene.mj_model, same.mj_model
    np.testing.assert_array_equal(model.jnt_limited, other.jnt_limited)
    np.testing.assert_array_equal(model.eq_obj1id, other.eq_obj1id)
    np.testing.assert_allclose(model.eq_data[:, :5], other.eq_data[:, :5])
    datas = [mujoco.MjData(m) for m in (model, other)]
    for row in np.random.default_rng(1).uniform(-1, 1, (20, model.nq)):
        for own, data in zip((model, other), datas, strict=True):
            data.qpos[:] = row
            mujoco.mj_kinematics(own, data)
        np.testing.assert_allclose(datas[0].xpos, datas[1].xpos, atol=1e-9)
        np.testing.assert_allclose(datas[0].xmat, datas[1].xmat, atol=1e-9)


def test_meshes_of_one_name_in_two_folders_are_two_meshes(tmp_path: Path):
    write_stl(tmp_path / "a" / "link.stl", (0.1, 0.1, 0.1))
    write_stl(tmp_path / "b" / "link.stl", (0.2, 0.2, 0.2))
    (tmp_path / "r.urdf").write_text(
        '<robot name="r">'
        + link("base", shape('<mesh filename="a/link.stl"/>'))
        + link("tip", shape('<mesh filename="b/link.stl" scale="1 1 2"/>'))
        + joint("j", "continuous", "base", "tip", '<axis xyz="0 0 1"/>')
        + "</robot>"
    )
    model = Scene.from_urdf(tmp_path / "r.urdf").mj_model
    halves = [model.mesh_vert[model.mesh_vertadr[i]] for i in model.geom_dataid]
    np.testing.assert_allclose(np.abs(halves[0]), 0.1, atol=1e-6)
    np.testing.assert_allclose(sorted(np.abs(halves[1])), [0.2, 0.2, 0.4], atol=1e-6)


@pytest.mark.parametrize("where", ["", "arm", "arm/meshes"])
def test_meshes_are_looked_for_in_the_folder_that_is_given(
    folder: Path, tmp_path_factory, where: str
):
    far = tmp_path_factory.mktemp("far") / "arm.urdf"
    far.write_text(ROBOT)
    with pytest.raises(FileNotFoundError, match=r"no mesh 'package://arm/meshes/upper"):
        Scene.from_urdf(far)
    assert Scene.from_urdf(far, meshes=folder / where).joints == ("turn", "tilt")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("package://arm/meshes/upper.stl", "upper.dae", "needs to be converted"),
        ('joint="grip"', 'joint="gripp"', "joint 'follow' mimics 'gripp', which does"),
        ("</robot>", "", r"arm\.urdf: no element found|arm\.urdf: .*line 1"),
        ("robot", "sdf", "expected <robot>, found <sdf>"),
        ('<link name="flange">', '<xacro:arm/><link name="flange">', "run xacro first"),
        ('child link="finger"', 'child link="fingr"', r"arm\.urdf: .*parent or child"),
    ],
)
def test_what_is_wrong_in_a_urdf_is_said_in_a_line(
    folder: Path, urdf: Path, old: str, new: str, message: str
):
    (folder / "arm" / "urdf" / "upper.dae").write_text("")
    urdf.write_text(ROBOT.replace(old, new))
    with pytest.raises(ValueError, match=message) as error:
        Scene.from_urdf(urdf)
    assert "\n" not in str(error.value)


def test_a_urdf_is_one_of_the_files_that_a_scene_is_read_from(urdf: Path):
    scene, same = Scene.from_mjcf(str(urdf)), Scene.from_urdf(urdf)
    assert (scene.joints, scene.pairs) == (same.joints, same.pairs)
    urdf.write_text(ROBOT.replace(".02", "-.02"))
    with pytest.raises(ValueError, match=r"arm\.urdf: .*size"):
        Scene.from_mjcf(urdf)


def test_files_that_are_not_there_are_named(urdf: Path):
    with pytest.raises(FileNotFoundError, match=r"no such file: .*none\.urdf"):
        Scene.from_urdf(urdf.with_name("none.urdf"))
    with pytest.raises(FileNotFoundError, match=r"no such file: .*none\.srdf"):
        Scene.from_urdf(urdf, srdf=urdf.with_name("none.srdf"))


SRDF = """<robot name="r">
  <group name="chain"><chain base_link="base" tip_link="lower"/></group>
  <group name="one"><joint name="tilt"/><joint name="stiff"/></group>
  <group name="gripper"><link name="finger"/><link name="mirror"/></group>
  <group name="whole"><group name="one"/><joint name="turn"/></group>
  <disable_collisions link1="base" link2="lower" reason="Never"/>
  <disable_collisions link1="base" link2="camera" reason="Adjacent"/>
</robot>"""


@pytest.fixture
def srdf(urdf: Path) -> Path:
    path = urdf.with_suffix(".srdf")
    path.write_text(SRDF.replace('"camera"', '"upper"'))
    return path


def test_an_srdf_disables_pairs_and_names_groups(urdf: Path, srdf: Path):
    pairs = {
        frozenset(group.name.split("|"))
        for group in Scene.from_urdf(urdf, exclude=None).groups
    }
    scene = Scene.from_urdf(urdf, srdf, joints="chain")
    left = {frozenset(group.name.split("|")) for group in scene.groups}
    assert pairs - left == {frozenset({"base", x}) for x in ("lower", "upper")}
    assert {row[:3] for row in scene.excluded} == {
        ("base", "lower", "given"),
        ("base", "upper", "given"),
    }
    assert scene.joints == ("turn", "tilt")
    assert Scene.from_urdf(urdf, srdf, joints="one").joints == ("tilt",)
    assert Scene.from_urdf(urdf, srdf, joints="gripper").joints == ("grip",)
    assert Scene.from_urdf(urdf, srdf, joints="whole").joints == ("turn", "tilt")
    with pytest.raises(ValueError, match="no group 'chian': did you mean 'chain'"):
        Scene.from_urdf(urdf, srdf, joints="chian")


def test_links_of_another_variant_are_left_out_with_a_warning(urdf: Path, srdf: Path):
    srdf.write_text(SRDF)
    with pytest.warns(UserWarning, match="the robot has not: camera"):
        scene = Scene.from_urdf(urdf, srdf)
    assert scene.excluded[0][:2] == ("base", "lower")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('tip_link="lower"', 'tip_link="lowr"', "no link 'lowr': did you mean 'lower'"),
        (
            'base_link="base"',
            'base_link="finger"',
            "'finger' is not above its tip_link",
        ),
        ('<group name="one"/>', '<group name="whole"/>', "'whole' is part of itself"),
        ("robot", "urdf", "expected <robot>, found <urdf>"),
    ],
)
def test_what_is_wrong_in_an_srdf_is_said_in_a_line(
    urdf: Path, srdf: Path, old: str, new: str, message: str
):
    srdf.write_text(srdf.read_text().replace(old, new))
    with pytest.raises(ValueError, match=rf"arm\.srdf: .*{message}"):
        Scene.from_urdf(urdf, srdf)

"""Bases that drive stand where they are unless their joints are named; two arms in one plan."""

import mujoco
import numpy as np
import pytest

from jaxplan.motion import Planner
from jaxplan.scene import Scene

LINK = '<geom type="capsule" size=".03" fromto="0 0 0 .25 0 0"/>'


def robot(base: str, lift: str = "") -> str:
    """A base with two arms of two links, side by side."""
    arms = "".join(
        f'<body name="{s}1" pos="0 {y} .2"><joint name="{s}1" axis="0 0 1" range="-2 2"/>'
        f'{LINK}<body name="{s}2" pos=".25 0 0"><joint name="{s}2" axis="0 0 1" '
        f'range="-2 2"/>{LINK}</body></body>'
        for s, y in (("l", 0.2), ("r", -0.2))
    )
    return (
        f'<mujoco><compiler angle="radian"/><worldbody><body name="base">{base}{lift}'
        f'<geom type="cylinder" size=".1 .1"/>{arms}</body></worldbody></mujoco>'
    )


def slide(name: str, axis: str, limits: str = "") -> str:
    return f'<joint name="{name}" type="slide" axis="{axis}" {limits}/>'


X, Y = slide("x", "1 0 0"), slide("y", "0 1 0")
FAR = 'range="-20 20"'
X20, Y20 = slide("x", "1 0 0", FAR), slide("y", "0 1 0", FAR)
YAW = '<joint name="yaw" axis="0 0 1"/>'
PITCH = '<joint name="yaw" axis="0 1 0"/>'
LIFT = slide("lift", "0 0 1", 'range="0 1"')


@pytest.mark.parametrize(
    ("base", "driving"),
    [
        (X + Y + YAW, "x y yaw"),
        (X20 + Y20 + YAW, "x y yaw"),
        (X + Y, "x y"),
        (X + Y + LIFT, "x y"),
        (X20 + Y20 + LIFT, ""),  # a gantry
        (X20 + Y20 + PITCH, ""),
        (X20 + YAW, ""),
        (X, ""),
        (YAW, ""),
    ],
)
def test_joints_that_drive_a_base_are_not_the_arms_by_default(base: str, driving: str):
    model = mujoco.MjModel.from_xml_string(robot(base))
    above = [model.joint(j).name for j in range(model.njnt)][:-4]
    lift = [name for name in above if name not in driving.split()]
    if len(lift) > 1:  # the arms are shorter than what they stand on, as fingers are
        assert Scene.from_mjcf(model).joints == tuple(lift)
        return
    arms = "; ".join(", ".join([*lift, f"{side}1", f"{side}2"]) for side in "lr")
    with pytest.raises(ValueError, match=rf"there are {arms}$"):
        Scene.from_mjcf(model)


def test_fingers_on_a_base_that_drives_are_no_arms():
    fingers = "".join(
        f'<body name="{s}"><joint name="{s}" axis="0 0 1"/>{LINK}</body>' for s in "lr"
    )
    for base in (X + Y, X20 + Y20 + YAW):
        text = f'<body>{base}<geom size=".1"/>{fingers}</body>'
        scene = Scene.from_mjcf(f"<mujoco><worldbody>{text}</worldbody></mujoco>")
        assert scene.passive == ("l", "r")


def test_where_only_the_base_moves_it_is_planned_for():
    for base, joints in ((X + Y, "xy"), (X20 + Y20 + YAW, ["x", "y", "yaw"])):
        text = f'<mujoco><worldbody><body>{base}<geom size=".1"/></body></worldbody></mujoco>'
        assert Scene.from_mjcf(text).joints == tuple(joints)


def test_two_arms_pass_each_other_in_one_plan():
    joints = ["l1", "l2", "r1", "r2"]
    planner = Planner(Scene.from_mjcf(robot(X + Y + YAW), joints=joints))
    rng, free = np.random.default_rng(0), planner.config.margin + 0.01
    # The first question that has no straight answer.
    starts, goals = rng.uniform(-2, 2, (2, 200, 4))
    middles = np.linspace(starts, goals, 50, axis=1)
    clear = planner.clearance(middles.reshape(-1, 4)).reshape(200, 50)
    asked = (clear[:, [0, -1]] > free).all(-1) & (clear.min(-1) < -0.01)
    start, goal = (q[np.flatnonzero(asked)[0]] for q in (starts, goals))
    plan = planner.plan(start, goal, seed=0)
    assert plan.solved
    assert planner.certify(plan).valid
    assert not planner.certify([start, goal]).valid

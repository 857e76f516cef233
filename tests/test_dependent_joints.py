"""`<equality><joint>` as kinematics, against C MuJoCo and our own polynomials."""

import functools

import jax
import mujoco
import numpy as np
import pytest

from jaxplan.collision import (
    OWN_AXES,
    XLA_OPTIONS,
    World,
    clearance,
    clearance_mujoco,
    make_world,
)
from jaxplan.collision.kinematics import link_poses
from jaxplan.collision.oracle import mujoco_model
from jaxplan.collision.positions import qpos_rows
from jaxplan.motion import Planner
from jaxplan.scene import Scene
from jaxplan.scene.dependent import Dependent, follow, spread

SEEDS = range(6)


def random_model(seed: int) -> str:
    """A tree of hinges and slides, some of which follow others by random polynomials."""
    rng = np.random.default_rng(seed)
    count = 9
    order = rng.permutation(count)
    bodies = ["" for _ in range(count)]
    for i in reversed(range(count)):
        pos, axis = rng.normal(size=(2, 3))
        quat = rng.normal(size=4)
        kind = rng.choice(["hinge", "slide"])
        below = bodies[i]
        text = (
            f'<body name="b{i}" pos="{_text(0.2 * pos)}" quat="{_text(quat)}">'
            f'<joint name="j{i}" type="{kind}" axis="{_text(axis)}" '
            f'ref="{rng.normal() * 0.3:.6f}" pos="{_text(0.1 * rng.normal(size=3))}"/>'
            f'<geom size=".02" mass="1"/>{below}</body>'
        )
        # A line with branches at its end.
        parent = i - 1 if i < 6 else 5
        if i:
            bodies[parent] += text
    ties = ""
    for k in rng.choice(np.arange(1, count), 5, replace=False):
        follower, master = order[k], order[rng.integers(k)]
        degree = rng.integers(0, 5)
        polycoef = np.zeros(5)
        polycoef[: degree + 1] = 0.5 * rng.normal(size=degree + 1)
        tied = f' joint2="j{master}"' if rng.random() < 0.85 else ""
        ties += (
            f'<joint joint1="j{follower}"{tied} polycoef="{_text(polycoef)}" '
            f'active="{"true" if rng.random() < 0.85 else "false"}"/>'
        )
    return (
        '<mujoco><compiler angle="radian"/><worldbody>'
        '<geom name="ball" size=".3" pos=".5 .5 0"/>'
        f"{text}</worldbody><equality>{ties}</equality></mujoco>"
    )


def _text(numbers) -> str:
    return " ".join(f"{number:.6f}" for number in numbers)


def settled(model: mujoco.MjModel, qpos: np.ndarray) -> np.ndarray:
    """`[nq]` with the followers where the active equalities put them."""
    qpos = qpos.copy()
    address, zero = model.jnt_qposadr, model.qpos0
    for _ in range(model.neq):
        for e in np.flatnonzero(model.eq_active0):
            joint, master = address[model.eq_obj1id[e]], model.eq_obj2id[e]
            x = qpos[address[master]] - zero[address[master]] if master >= 0 else 0.0
            qpos[joint] = zero[joint] + np.polyval(model.eq_data[e, 4::-1], x)
    return qpos


@functools.cache
def scene_of(seed: int) -> Scene:
    model = mujoco.MjModel.from_xml_string(random_model(seed))
    tied = set(model.eq_obj1id[model.eq_active0 != 0].tolist())
    free = [model.joint(i).name for i in range(model.njnt) if i not in tied]
    return Scene.from_mjcf(model, joints=free[: max(1, len(free) - 1)])


def random_rows(scene: Scene, seed: int, count: int) -> tuple[World, np.ndarray]:
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1, 1, (count, len(scene.joints))).astype(np.float32)
    passive = rng.uniform(-1, 1, (count, len(scene.passive))).astype(np.float32)
    return make_world(scene, passive=passive), q


@pytest.mark.parametrize("seed", SEEDS)
def test_bodies_are_where_mujoco_has_them(seed: int):
    scene = scene_of(seed)
    model = scene.mj_model
    active = model.eq_obj1id[model.eq_active0 != 0]
    assert sorted(scene.dependent) == sorted(model.joint(j).name for j in active)
    world, q = random_rows(scene, seed, 5)
    last = World(*(np.moveaxis(leaf, 0, -1) for leaf in _rows(world, 5)))
    poses = np.asarray(link_poses(scene, last, q.T))
    data = mujoco.MjData(model)
    for row in range(5):
        qpos = model.qpos0.copy()
        qpos[scene.addresses(scene.joints)] = q[row]
        qpos[scene.addresses(scene.passive)] = np.asarray(world.passive)[row]
        data.qpos[:] = settled(model, qpos)
        mujoco.mj_kinematics(model, data)
        for body, link in scene.structure.link_of.items():
            np.testing.assert_allclose(
                poses[link, :, 3, row], data.xpos[body], atol=2e-5
            )
            np.testing.assert_allclose(
                poses[link, :, :3, row], data.xmat[body].reshape(3, 3), atol=5e-5
            )


@pytest.mark.parametrize("seed", SEEDS)
def test_mujoco_is_asked_where_its_own_equalities_hold(seed: int):
    scene = scene_of(seed)
    world, q = random_rows(scene, seed, 5)
    model = mujoco_model(scene)
    data = mujoco.MjData(model)
    for qpos in qpos_rows(scene, _rows(world, 5), q):
        np.testing.assert_allclose(qpos, settled(model, qpos), atol=1e-12)
        data.qpos[:] = qpos
        mujoco.mj_forward(model, data)
        assert data.ne == (model.eq_active0 != 0).sum()
        equalities = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        np.testing.assert_allclose(data.efc_pos[equalities], 0, atol=1e-12)


@pytest.mark.parametrize("seed", [0, 3])
def test_all_backends_agree(seed: int):
    scene = scene_of(seed)
    world, q = random_rows(scene, seed, 40)
    expected = clearance_mujoco(scene, world, q, reach=10.0)
    assert (expected < 0).any()
    for backend in ("fast", "mjx"):
        query = jax.jit(
            lambda world, q, b=backend: clearance(scene, world, q, b),
            compiler_options=XLA_OPTIONS,
        )
        np.testing.assert_allclose(query(world, q), expected, atol=1e-4)


def _rows(world: World, count: int) -> World:
    """With a leading axis on every leaf, in NumPy."""
    return World(
        *(
            np.broadcast_to(leaf, (count, *leaf.shape[leaf.ndim - n :]))
            for leaf, n in zip(world, OWN_AXES, strict=True)
        )
    )


def arm(joints: str = "abc", more: str = "", **own: str) -> str:
    """A line of hinges or slides; `own` gives attributes of a joint by its name."""
    text = more
    for name in reversed(joints):
        text = (
            f'<body name="{name}" pos="0 0 .3"><joint name="{name}" {own.get(name, "")}/>'
            f'<geom name="{name}" size=".05"/><site name="{name}"/>{text}</body>'
        )
    return text


def model(worldbody: str, equality: str = "", more: str = "") -> str:
    return (
        f'<mujoco><compiler angle="radian"/><worldbody>{worldbody}</worldbody>'
        f"<equality>{equality}</equality>{more}</mujoco>"
    )


def tie(joint: str, master: str = "", polycoef: str = "0 1 0 0 0") -> str:
    second = f'joint2="{master}"' if master else ""
    return f'<joint joint1="{joint}" {second} polycoef="{polycoef}"/>'


@pytest.mark.parametrize(
    ("ties", "joints", "arm_joints", "dependent"),
    [
        (tie("b", "a"), None, "ac", "b"),
        (tie("a", "b"), None, "bc", "a"),
        (tie("b", "a") + tie("c", "b"), None, "a", "bc"),
        (tie("b"), None, "ac", "b"),
        (tie("b", "a"), "ac", "ac", "b"),
        # The roles turn round.
        (tie("b", "a"), "b", "b", "a"),
        (tie("b", "a") + tie("c", "b"), "c", "c", "ba"),
        (tie("b", "a") + tie("c", "b"), "b", "b", "ac"),
        # Left out, because nothing turns round.
        (tie("b", "door", "0 0 1 0 0"), None, "ac", "b"),
        (tie("b", "door", "0 2 0 0 0"), None, "abc", "e"),
    ],
)
def test_who_follows_whom(ties: str, joints, arm_joints: str, dependent: str):
    door = arm("e").replace('joint name="e"', 'joint name="door"')
    text = model(arm() + door, ties)
    scene = Scene.from_mjcf(text, joints and list(joints))
    assert scene.joints == tuple(arm_joints)
    expected = {"door" if name == "e" else name for name in dependent}
    assert set(scene.dependent) == expected
    assert not {*scene.passive} & {*scene.dependent, *scene.joints}
    again = scene.replace(geom_quat=scene.model.geom_quat)
    assert again.joints == scene.joints
    assert again.dependent == scene.dependent


@pytest.mark.parametrize(
    ("ties", "joints", "line"),
    [
        (tie("b", "a"), "ab", "joint 'b' follows joint 'a' .*leave it out"),
        (tie("c", "b") + tie("b", "a"), "ac", "joint 'c' follows joint 'a'"),
        (tie("b", "a") + tie("c", "a"), "bc", "joint 'c' follows joint 'b'"),
        (tie("b", "a", "0 1 1 0 0"), "b", "'b' follows joint 'a' .*straight line"),
        (tie("b", "a", "1 0 0 0 0"), "b", "'b' follows joint 'a' .*straight line"),
        (tie("b"), "b", "joint 'b' is fixed by an equality"),
        (tie("b", "a") + tie("a", "b"), None, "joints 'b', 'a' follow each other"),
        (tie("b", "a") + tie("b", "c"), None, "joint 'b' follows two equality"),
        (tie("b", "a", "nan 1 0 0 0"), None, "joint 'b' has polycoef .*not finite"),
        (tie("a") + tie("b") + tie("c"), None, "no hinge or slide joint"),
    ],
)
def test_what_cannot_be_planned_for_is_named(ties: str, joints, line: str):
    with pytest.raises(ValueError, match=line):
        Scene.from_mjcf(model(arm(), ties), joints and list(joints))


def test_the_hand_is_behind_the_joints_that_follow():
    telescope = model(arm("abc", arm("fg")), tie("b", "a") + tie("c", "a"))
    scene = Scene.from_mjcf(telescope, joints=["a"])
    assert (scene.joints, scene.hand) == (("a",), "c")


def limits_by_search(scene: Scene, at: np.ndarray) -> np.ndarray:
    """Whether each value of the only joint keeps all limits of the model."""
    model = scene.mj_model
    inside = []
    for value in at:
        qpos = model.qpos0.copy()
        qpos[scene.addresses(scene.joints)] = value
        q = settled(model, qpos)[model.jnt_qposadr]
        over = (q < model.jnt_range[:, 0]) | (q > model.jnt_range[:, 1])
        inside.append(not (over & (model.jnt_limited != 0)).any())
    return np.array(inside)


@pytest.mark.parametrize("seed", range(40))
def test_limits_are_those_of_all_that_follow(seed: int):
    rng = np.random.default_rng(seed)
    low, high = -rng.uniform(0.1, 2, 4), rng.uniform(0.1, 2, 4)
    ranges = {
        name: f'range="{low[i]:.3f} {high[i]:.3f}" ref="{rng.uniform(-0.05, 0.05):.3f}"'
        for i, name in enumerate("abcd")
    }
    if seed % 3 == 0:
        ranges["a"] = ""
    ties = ""
    for name, master in ("ba", "ca", ("d", rng.choice([*"abc"]))):
        polycoef = 2 * rng.normal(size=5) * (np.arange(5) <= rng.integers(1, 5))
        polycoef[0] *= 0.01
        ties += tie(name, master, _text(polycoef))
    scene = Scene.from_mjcf(model(arm("abcd", **ranges), ties))
    assert scene.joints == ("a",)
    ends = np.array([scene.q_min[0], scene.q_max[0]])
    assert ends[0] < ends[1]
    assert np.isfinite(ends).all()
    assert limits_by_search(scene, np.linspace(*ends, 201)[1:-1]).all()
    assert not limits_by_search(scene, ends + np.array([-1e-5, 1e-5])).any()
    reference = scene.model.qpos0[scene.addresses(["a"])][0]
    if limits_by_search(scene, np.array([reference])).all():
        assert ends[0] <= reference <= ends[1]


def test_limits_that_leave_nothing_are_refused_by_name():
    text = model(
        arm("ab", a='range="0 1"', b='range="0 1"'), tie("b", "a", "3 1 0 0 0")
    )
    with pytest.raises(
        ValueError, match=r"joint 'a' has no value .* 'b', which follow"
    ):
        Scene.from_mjcf(text)


@pytest.mark.parametrize(
    ("ties", "own", "expected"),
    [
        ("", {}, True),
        ("", {"a": 'range="-9 9"'}, False),
        ("", {"a": 'type="slide"'}, False),
        (tie("b", "a", ".3 -2 0 0 0"), {}, True),
        (tie("b", "a", "0 .5 0 0 0"), {}, False),
        (tie("b", "a", "0 0 1 0 0"), {}, False),
        (tie("b", "a", "0 1 0 0 0"), {"b": 'range="-1 1"'}, False),
        (tie("b", "a", "0 1 0 0 0"), {"b": 'type="slide"'}, False),
        (tie("b", "a", ".2 0 0 0 0"), {"b": 'type="slide"'}, True),
        # Half of a half turn, twice: whole again.
        (tie("b", "a", "0 2 0 0 0") + tie("c", "b", "0 .5 0 0 0"), {}, True),
        (tie("b", "a", "0 .5 0 0 0") + tie("c", "b", "0 2 0 0 0"), {}, False),
    ],
)
def test_a_circle_closes_only_if_all_that_follows_comes_back(ties, own, expected):
    scene = Scene.from_mjcf(model(arm("abc", **own), ties), joints=["a"])
    assert scene.circular.tolist() == [expected]
    if expected:
        assert (scene.q_min[0], scene.q_max[0]) == (-np.inf, np.inf)


@pytest.mark.parametrize("seed", SEEDS)
def test_no_joint_moves_faster_than_its_rate(seed: int):
    scene = scene_of(seed)
    _, q = random_rows(scene, seed, 200)
    still = make_world(scene)
    near = (
        q + np.random.default_rng(seed).normal(size=q.shape).astype(np.float32) * 1e-3
    )
    ids = [*scene.structure.variables]
    address = scene.mj_model.jnt_qposadr[ids]
    rows = [qpos_rows(scene, _rows(still, 200), x)[:, address] for x in (q, near)]
    assert scene.rates.shape == (len(ids), len(scene.joints))
    most = np.abs(near - q) @ np.nan_to_num(scene.rates, posinf=1e30).T
    assert (np.abs(rows[1] - rows[0]) <= most * (1 + 1e-9) + 1e-9).all()


SLIDE = 'type="slide" axis="1 0 0" range="0 .5"'


def test_a_telescope_is_planned_as_one_joint():
    text = model(
        '<geom name="post" size=".05" pos=".6 0 .6"/>' + arm("ab", a=SLIDE, b=SLIDE),
        tie("b", "a"),
    )
    scene = Scene.from_mjcf(text)
    planner = Planner(scene)
    assert planner.plan([0.0], [0.2]).solved
    path = planner.plan([0.0], [0.2]).path
    assert planner.certify(path).valid
    rows = qpos_rows(scene, _rows(make_world(scene), len(path)), path)
    np.testing.assert_allclose(rows[:, 0], rows[:, 1])
    # b stands at twice the way of a.
    np.testing.assert_allclose(
        planner.clearance([[0.1], [0.3]]), [0.3, -0.1], atol=1e-6
    )
    assert not planner.certify([[0.0], [0.4]]).valid


HAND = (
    '<body name="f" pos=".1 0 .1"><joint name="f"/><geom size=".01"/><site name="f"/></body>'
    '<body name="g" pos="-.1 0 .1"><joint name="g"/><geom size=".01"/><site name="g"/></body>'
)
OTHERS = (
    '<body name="mug" pos="1 0 0"><freejoint/><geom name="mug" size=".05"/></body>'
    '<body name="handle" mocap="true" pos="1 1 0"/><site name="world"/>'
)


def spatial(limited: str, *wraps: str) -> str:
    inside = "".join(
        f'<site site="{w}"/>' if w != "|" else '<pulley divisor="2"/>' for w in wraps
    )
    return (
        f'<tendon><spatial name="t" range="0 1" {limited}>{inside}</spatial></tendon>'
    )


def fixed(limited: str, *joints: str) -> str:
    inside = "".join(f'<joint joint="{joint}" coef="1"/>' for joint in joints)
    return f'<tendon><fixed name="t" range="0 1" {limited}>{inside}</fixed></tendon>'


LIMITED, FREE = 'limited="true"', 'limited="false"'
TIED = '<tendon tendon1="t"/>'


@pytest.mark.parametrize(
    ("equality", "more", "line"),
    [
        (
            '<connect body1="c" anchor="0 0 0"/>',
            "",
            "connect number 0 .*'c' to 'world'",
        ),
        ('<connect name="x" site1="f" site2="g"/>', "", None),
        (
            '<connect name="x" site1="f" site2="a"/>',
            "",
            "connect 'x' .*'f' to 'a'",
        ),
        ('<weld body1="f" body2="g"/>', "", None),
        ('<weld body1="f" body2="b" active="false"/>', "", None),
        ('<weld body1="f" body2="b"/>', "", "closed loops are not supported"),
        ('<weld body1="mug" body2="c"/>', "", "carry the object with `held`"),
        ('<weld body1="mug"/>', "", None),
        ('<weld body1="handle" body2="c"/>', "", 'active="false" .*teleoperation'),
        ('<weld body1="handle" body2="mug"/>', "", None),
        (TIED, fixed(FREE, "a", "f"), "tendon 't' depends on the arm's joints"),
        (TIED, fixed(FREE, "g", "f"), None),
        ("", fixed(LIMITED, "a"), "tendon 't' has limits"),
        ("", fixed(LIMITED, "f", "g"), None),
        ("", fixed(FREE, "a", "b"), None),
        ("", spatial(LIMITED, "world", "c"), "tendon 't' has limits"),
        ("", spatial(LIMITED, "c", "f", "g"), None),
        ("", spatial(LIMITED, "c", "f", "|", "b", "a"), "tendon 't' has limits"),
        (TIED, spatial(FREE, "world", "f"), "tendon 't' depends"),
        # c follows a: what ties c ties the arm.
        (
            tie("c", "a") + '<connect site1="c" site2="b"/>',
            "",
            "connect .*'c' to 'b'",
        ),
        (tie("c", "a"), fixed(LIMITED, "c"), "tendon 't' has limits"),
        # f and g are nobody's business, even if one follows the other.
        (tie("f", "g") + '<connect site1="f" site2="c"/>', "", None),
    ],
)
def test_loops_and_tendons_are_refused_where_the_arm_feels_them(equality, more, line):
    text = model(arm("abc", HAND) + OTHERS, equality, more)
    if line is None:
        assert Scene.from_mjcf(text).joints[0] == "a"
    else:
        with pytest.raises(ValueError, match=line) as error:
            Scene.from_mjcf(text)
        assert "\n" not in str(error.value)
        off = "<option><flag equality='disable' constraint='disable'/></option>"
        assert Scene.from_mjcf(text.replace("<worldbody>", off + "<worldbody>"))


def test_fingers_follow_each_other_and_the_world():
    text = model(
        '<geom name="wall" type="box" size=".1 1 1" pos=".4 0 0"/>'
        + arm("ab", HAND, a='axis="0 0 1"', b='axis="0 0 1"').replace(
            'joint name="f"', 'joint name="f" type="slide" axis="1 0 0"'
        ),
        tie("f", "g", "0 .2 0 0 0"),
    )
    scene = Scene.from_mjcf(text)
    assert (scene.joints, scene.passive, scene.dependent) == (
        ("a", "b"),
        ("g",),
        ("f",),
    )
    for opened in (0.0, 0.5):
        world = make_world(scene, passive=[opened])
        expected = 0.3 - (0.1 + 0.2 * opened) - 0.01
        for distance in (clearance, clearance_mujoco):
            reach = {} if distance is clearance else {"reach": 1.0}
            np.testing.assert_allclose(
                distance(scene, world, np.zeros(2), **reach), expected, atol=1e-6
            )


def test_no_joint_gets_further_than_its_span():
    """Chains of random polynomials; at the end of a line the span is reached."""
    rng = np.random.default_rng(0)
    for trial in range(200):
        lines = trial % 2
        chain = [
            Dependent(0, int(rng.integers(2 + row)), tuple(rng.normal(size=n)))
            for row, n in enumerate(rng.integers(2, 3 if lines else 6, 4))
        ]
        x, span = rng.uniform(-3, 3, (2, 1)), rng.uniform(0, 2, (2, 1))
        moved = follow(chain, x)
        shares = np.concatenate([rng.uniform(-1, 1, (2, 500)), np.ones((2, 1))], 1)
        away = np.abs(np.stack(follow(chain, x + span * shares)) - moved)
        most = np.stack(spread(chain, moved, span))
        assert (away <= most * (1 + 1e-9) + 1e-12).all()
        if lines:
            np.testing.assert_allclose(away[:, -1:], most, rtol=1e-9)

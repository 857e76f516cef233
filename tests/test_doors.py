"""The doors: whatever makes no sense is one line with its name, and copies are as good."""

import copy
import dataclasses
import os
import pickle
import signal
import subprocess
import sys
import types
import typing
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tyro.conf import Positional

import jaxplan
import jaxplan.evaluation
import jaxplan.train
from jaxplan import (
    Plan,
    Planner,
    PlannerConfig,
    Scene,
    Status,
    TrajectoryConfig,
    collision,
    planning,
)
from jaxplan import make_world as world_for
from jaxplan.episodes import EpisodeConfig
from jaxplan.ik import Limits
from jaxplan.learning import SegmentTraining, TrainConfig
from jaxplan.learning.policy import PolicyTraining
from jaxplan.motion.blocks import SIZES
from jaxplan.motion.checks import seeds_of
from jaxplan.motion.goals import Goals
from jaxplan.motion.reasons import Asked, no_path
from jaxplan.ranges import Checked, Count, check, kinds

ARM = """
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <geom name="post" type="sphere" size="0.1" pos="0.5 0 0.3"/>
    <body name="rail" pos="0 0 0.3">
      <joint name="slide" type="slide" axis="0 1 0" range="-1 1" limited="true"/>
      <geom name="carriage" type="sphere" size="0.05"/>
      <body name="arm" pos="0.2 0 0">
        <joint name="turn" axis="0 0 1" range="-2 2" limited="true"/>
        <geom name="tip" type="sphere" size="0.05" pos="0.25 0 0"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
LEFT, RIGHT, HIT = [-0.5, 0.0], [0.5, 0.0], [0.0, 0.0]
ABSTRACT = TrainConfig, SegmentTraining, PolicyTraining
SMALL = PlannerConfig(max_expansions=500)


def settings(kind: type = Checked) -> set[type]:
    """All classes of settings that the package has."""
    below = {deeper for sub in kind.__subclasses__() for deeper in settings(sub)}
    return {kind, *below}


CONFIGS = [
    kind()
    for kind in sorted(settings(), key=lambda kind: kind.__name__)
    if kind.__module__.startswith("jaxplan.") and kind not in (Checked, *ABSTRACT)
]
FIELDS = [
    pytest.param(c, f.name, id=f"{type(c).__name__}.{f.name}")
    for c in CONFIGS
    for f in dataclasses.fields(c)
]
NOTHING = ("a", None, (), {}, object(), 1j, np.ones(2), b"1")
"""No setting that is a number, a word or a switch is one of these."""
RANGES = {"more than 0": (0, -1), "0 or more": (-1e-9, -1), "at least 1e-6": (0, -1),
          "at least 1e-6, or 0": (1e-9, -1), "0 to 1": (-0.1, 1.1),
          "more than 0, at most 1": (0, 1.1), "1 to 2^31 - 1": (0, 2**31),
          "0 to 2^31 - 1": (-1, 2**31), "finite": (),
          "0 to 45": (-0.1, 46), "0 to 0.1": (-0.1, 0.2)}  # fmt: skip
"""Numbers just outside each range."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(ARM)


@pytest.fixture(scope="module")
def planner(scene: Scene) -> Planner:
    return Planner(scene, SMALL)


@pytest.fixture(scope="module")
def answer(planner: Planner) -> Plan:
    answer = planner.plan(LEFT, RIGHT, seed=3)
    assert answer.solved
    return answer


def one_line(error: pytest.ExceptionInfo, *words: str) -> None:
    text = str(error.value)
    assert "\n" not in text
    assert len(text) < 300
    for word in words:
        assert word in text


# Settings


@pytest.mark.parametrize(("settings", "name"), FIELDS)
def test_every_setting_is_checked_by_name_type_and_range(settings, name):
    bad = bad_for(kinds(type(settings))[name], name)
    for value in bad:
        with pytest.raises(ValueError, match=f"^{name} ") as error:
            dataclasses.replace(settings, **{name: value})
        one_line(error, "expected")


def bad_for(kind, name: str) -> list:
    """What no setting of a kind may be; fails where the kind says no range."""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        one = next(part for part in inner if part is not type(None))
        return [value for value in bad_for(one, name) if value is not None]
    if origin is tuple:
        count = 2 if inner[-1] is Ellipsis else len(inner)
        each = [(value,) * count for value in bad_for(inner[0], name)]
        return [[1.0, 2.0], "ab", 1.0, *each]
    if origin is Literal:
        return [*NOTHING, 1, True, "prm", inner[0].upper()]
    if kind is bool:
        return [*NOTHING, 0, 1, 1.0, "True"]
    if kind is str:
        return [value for value in NOTHING if not isinstance(value, str)]
    if dataclasses.is_dataclass(kind):
        others = [*NOTHING, 1.0, PlannerConfig(), EpisodeConfig(), kind]
        return [value for value in others if not isinstance(value, kind)]
    assert origin is Annotated, f"{name} has no range"
    number, allowed = inner
    bad = [*NOTHING, np.nan, np.inf, -np.inf, True, np.bool_(1), 10**400, "1"]
    return [*bad, 1.5 if number is int else 1e39, *RANGES[allowed.words]]


@pytest.mark.parametrize(("settings", "name"), FIELDS)
def test_numbers_of_numpy_are_numbers(settings, name):
    value = getattr(settings, name)
    if isinstance(value, int | float):
        same = dataclasses.replace(settings, **{name: np.asarray(value)[()]})
        assert same == settings


def test_marks_for_a_parser_of_command_lines_are_no_ranges():
    @dataclass(frozen=True)
    class Args(Checked):
        place: Positional[Path]
        count: Positional[Count] = 1
        several: Positional[tuple[Path, ...]] = ()

    assert Args(Path("here")).count == 1
    for wrong, words in (
        ({"place": "here"}, "place 'here', expected a Path"),
        ({"count": 0}, "count 0, expected an integer, 1 to 2"),
        ({"several": (1,)}, "several"),
    ):
        with pytest.raises(ValueError, match=words):
            Args(**{"place": Path("here")} | wrong)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"step_min": 2.0, "step_max": 1.0}, "step_min, step_max 2.0, 1.0"),
        ({"step_max": 1e3, "edge_resolution": 1e-6}, "edge_resolution 1e-06"),
        ({"metric": (1.0, 1.0, 1.0)}, "expected 2 weights"),
        ({"metric": ()}, "expected 2 weights"),
    ],
)
def test_settings_that_do_not_fit_together_are_refused_at_once(scene, settings, words):
    with pytest.raises(ValueError, match="expected") as error:
        Planner(scene, PlannerConfig(**settings))
    one_line(error, words)


# Arguments of the planner

NOT_NUMBERS = (None, "abc", {}, object(), [None] * 2, ["a", "b"], [True, False], [[1], 2],
               [1j, 0], np.array(["1", "2"]), [10**400, 0])  # fmt: skip
NOT_Q = (*NOT_NUMBERS, 1.0, True, [], [0.0], [0.0] * 3, np.zeros((1, 1)))
NOT_SEEDS = (-1, 2**32, 1.5, "0", None, np.nan, True, False, np.bool_(1), jnp.array(True),
             np.array(True), np.array([1]), jnp.array([1]), jnp.float32(1), 1j)  # fmt: skip
NOT_POSITIVE = (0, -1, np.nan, np.inf, None, "fast", True, 1j, [1.0], jnp.array([1.0]))
NOT_WORLDS = ("world", 3, {}, [], (1, 2))


def refused(name: str, calls: dict) -> list:
    return [
        pytest.param(name, value, call) for call, bad in calls.items() for value in bad
    ]


def planner_with(**settings):
    return lambda planner, value: Planner(
        planner.scene,
        **{name: value if given is ... else given for name, given in settings.items()},
    )


REFUSED = [
    *refused("q_start", {lambda p, v: p.plan(v, RIGHT): NOT_Q}),
    *refused("q_goal", {lambda p, v: p.plan(LEFT, v): NOT_Q}),
    *refused("seed", {lambda p, v: p.plan(LEFT, RIGHT, v): NOT_SEEDS}),
    *refused("seed", {lambda p, v: p.plan_batch([LEFT], [RIGHT], v): (3, None, [1.5], [True])}),
    *refused("World", {lambda p, v: p.plan(LEFT, RIGHT, 0, v): NOT_WORLDS}),
    *refused("orld", {lambda p, v: p.plan_batch([LEFT], [RIGHT], [0], v): NOT_WORLDS}),
    *refused("q_starts", {lambda p, v: p.plan_batch(v, [RIGHT]): (*NOT_Q, LEFT)}),
    *refused("qs", {lambda p, v: p.clearance(v): NOT_Q[:-1]}),
    *refused("World", {lambda p, v: p.clearance(LEFT, v): NOT_WORLDS}),
    *refused("plan", {lambda p, v: p.time(v): (None, 3, "plan", [LEFT, RIGHT])}),
    *refused("velocity", {planner_with(velocity=...): (*NOT_POSITIVE[:-2], [1, 2, 3], [1, 0])}),
    *refused("acceleration", {planner_with(acceleration=...): (*NOT_POSITIVE[:-2], [1, 2, 3])}),
    *refused("q_min", {planner_with(q_min=...): (*NOT_NUMBERS[1:-1], [0.0] * 3, True)}),
    *refused("q_max", {planner_with(q_max=...): (*NOT_NUMBERS[1:-1], [0.0] * 3, True)}),
    *refused("config", {planner_with(config=...): (None, {}, 3, TrajectoryConfig())}),
    *refused("trajectory", {planner_with(trajectory=...): (None, {}, 3, PlannerConfig())}),
    *refused("sampler", {planner_with(sampler=...): (3, "up", [])}),
    *refused("scene", {lambda p, v: Planner(v): (None, "robot.xml", 3)}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value", "call"), REFUSED)
def test_an_argument_that_is_none_is_named(planner, name, value, call):
    if (name, value) == ("seed", None):
        return  # plan_batch has seeds of its own
    with pytest.raises(ValueError, match=name) as error:
        call(planner, value)
    one_line(error)


Q = np.zeros(2)
COLLISION = [
    *refused("q ", {lambda s, w, v: collision.clearance(s, w, v): NOT_Q[:-1],
                    lambda s, w, v: collision.config_free(s, w, v): NOT_Q[:-1],
                    lambda s, w, v: collision.clearance_mujoco(s, w, v): NOT_Q[:-1],
                    lambda s, w, v: collision.closest_pair(s, w, v): NOT_Q[:-1]}),
    *refused("q0 ", {lambda s, w, v: collision.motion_free(s, w, v, Q, 3): NOT_Q[:-1]}),
    *refused("q1 ", {lambda s, w, v: collision.motion_free(s, w, Q, v, 3): NOT_Q[:-1]}),
    *refused("points ", {lambda s, w, v: collision.motion_free(s, w, Q, Q, v):
                         (0, -1, 1.5, True, None, "3", np.nan)}),
    *refused("world ", {lambda s, w, v: collision.clearance(s, v, Q): NOT_WORLDS,
                        lambda s, w, v: collision.closest_pair(s, v, Q): NOT_WORLDS}),
    *refused("world.", {lambda s, w, v: collision.clearance(s, w._replace(**v), Q): (
        {"passive": np.zeros(3)}, {"object_pose": np.zeros((1, 7))}, {"held": None},
        {"slot_pose": "abc"}, {"slot_size": np.zeros(3)}, {"ignored": np.zeros(99)})}),
    *refused("scene ", {lambda s, w, v: collision.clearance(v, w, Q): (None, 3, "scene"),
                        lambda s, w, v: collision.always_touching(v): (None, 3, "scene"),
                        lambda s, w, v: collision.make_world(v): (None, 3, "scene")}),
    *refused("margin", {lambda s, w, v: collision.config_free(s, w, Q, v): ("a", None, 1j)}),
    *refused("backend ", {lambda s, w, v: collision.clearance(s, w, Q, v): ("slow", None, 3)}),
    *refused("reach ", {lambda s, w, v: collision.closest_pair(s, w, Q, v): NOT_POSITIVE[1:]}),
    *refused("samples ", {lambda s, w, v: collision.always_touching(s, v): (0, 1.5, True)}),
    *refused("resolution ", {lambda s, w, v: planning.points_for(1.0, v): NOT_POSITIVE}),
    *refused("length ", {lambda s, w, v: planning.points_for(v, 0.1): NOT_POSITIVE[1:]}),
    *refused("source ", {lambda s, w, v: Scene.from_mjcf(v): (None, 3, [], b"<mujoco/>")}),
    *refused("joints ", {lambda s, w, v: Scene.from_mjcf(ARM, v): ("turn", 3, [1], {})}),
    *refused("hand ", {lambda s, w, v: Scene.from_mjcf(ARM, hand=v): (3, ["arm"], True)}),
    *refused("slots", {lambda s, w, v: Scene.from_mjcf(ARM, slots=v): (
        3, "box", ["box"], {"box": -1}, {"box": 1.5}, {"box": True}, {3: 1}, {"box": "2"})}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value", "call"), COLLISION)
def test_an_argument_of_scene_and_collision_is_named(scene, name, value, call):
    with pytest.raises(ValueError, match=f"^{name}") as error:
        call(scene, world_for(scene), value)
    one_line(error)


@pytest.mark.parametrize("speed", NOT_POSITIVE)
def test_a_speed_that_is_none_is_named(planner, answer, speed):
    with pytest.raises(ValueError, match=r"^speed ") as error:
        planner.time(answer, speed)
    one_line(error)


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        ([0.0, 1.0], [1.0, 0.5], "joint 'turn' has limits 1.0 to 0.5"),
        ([0.5, 1.0], [0.5, 1.5], "joint 'slide' has limits 0.5 to 0.5"),
        ([0.0, np.nan], None, "joint 'turn' has limits nan to 2.0"),
        (None, [np.nan, 1.0], "joint 'slide' has limits -1.0 to nan"),
        (np.inf, np.inf, "joint 'slide' has limits inf to inf"),
        (3.0, None, "joint 'slide' has limits 3.0 to 1.0"),
    ],
)
def test_limits_without_room_are_named_by_joint(scene, low, high, words):
    with pytest.raises(ValueError, match="q_min < q_max") as error:
        Planner(scene, q_min=low, q_max=high)
    one_line(error, words)


@pytest.mark.parametrize(
    "seed",
    [3, np.int64(3), np.uint8(3), jnp.array(3), jnp.uint32(3), np.array(3)],
)
def test_integers_of_every_kind_are_seeds(planner, answer, seed):
    again = planner.plan(LEFT, RIGHT, seed=seed)
    assert type(again.seed) is int
    assert np.array_equal(again.path, answer.path)


@pytest.mark.parametrize("kind", [list, tuple, np.array, jnp.array, iter])
def test_seeds_of_a_batch_are_any_sequence(kind):
    assert seeds_of(kind([3, 0, 5])) == [3, 0, 5]


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (np.zeros((0, 2)), "no waypoints"),
        (np.array([LEFT, [np.nan, 0], RIGHT]), "waypoint 1 of the path is not finite"),
        (np.array([LEFT, [0, np.inf]]), "waypoint 1 of the path is not finite"),
        (np.zeros((3, 1)), r"path has shape \(3, 1\)"),
        (np.zeros(2), r"path has shape \(2,\)"),
        (None, "path is not an array"),
    ],
)
def test_a_path_made_by_hand_is_checked_before_it_is_timed(
    planner, answer, path, words
):
    with pytest.raises(ValueError, match=words) as error:
        planner.time(dataclasses.replace(answer, path=path))
    one_line(error)


@pytest.mark.parametrize("value", [jnp.array(1.0), np.float32(1), np.array(1), 1])
def test_a_speed_of_any_kind_of_number_is_one(planner, answer, value):
    assert planner.time(answer, value).free


def test_a_check_says_no_more_than_a_line_about_what_it_was_given():
    for value in (10**5000, "a\nb" * 100, np.ones((40, 40)), Scene.from_mjcf):
        with pytest.raises(ValueError, match=r"^x ") as error:
            check("x", value, float)
        one_line(error)


# Clearance


def test_any_number_of_rows_compiles_few_programs(scene):
    fresh, q = Planner(scene, SMALL), np.random.default_rng(0).uniform(-1, 1, (700, 2))
    compiled: list[str] = []

    def listen(event: str, *_, **__) -> None:
        if "backend_compile" in event:
            compiled.append(event)

    world = fresh.empty_world
    whole = np.asarray(
        jax.jit(lambda q: jaxplan.collision.clearance(scene, world, q))(q)
    )
    jax.monitoring.register_event_duration_secs_listener(listen)
    for count in (1, 2, 5, 16, 17, 40, 255, 256, 257, 300, 512, 700, 3, 699):
        found = fresh.clearance(q[:count])
        np.testing.assert_allclose(found, whole[:count], atol=1e-6)
        assert len(compiled) <= len(SIZES)
    jax.monitoring.unregister_event_duration_listener(listen)


def test_clearance_has_the_shape_of_its_question(planner):
    q = np.random.default_rng(1).uniform(-1, 1, (2, 3, 2))
    found = planner.clearance(q)
    assert found.shape == (2, 3)
    assert planner.clearance(q[0, 0]).shape == ()
    np.testing.assert_allclose(found[1, 2], planner.clearance(q[1, 2]), atol=1e-6)
    for shape in ((0, 2), (3, 0, 2)):
        assert planner.clearance(np.zeros(shape)).shape == shape[:-1]
        assert planner.clearance(np.zeros(shape)).dtype == np.float32


def test_clearance_takes_a_world_for_each_row():
    scene = Scene.from_mjcf(ARM, slots={"sphere": 1})
    planner = Planner(scene, SMALL)
    obstacles = [
        jaxplan.Obstacle("sphere", [0.05], [0.4, y, 0.3]) for y in (0.4, 0.6, 2)
    ]
    worlds = [world_for(scene, obstacles=[one]) for one in obstacles]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *worlds)
    alone = [planner.clearance(RIGHT, world) for world in worlds]
    assert len(set(map(float, alone))) == 3
    np.testing.assert_allclose(planner.clearance(RIGHT, stacked), alone, atol=1e-6)
    each = planner.clearance(np.tile(RIGHT, (3, 1)), stacked)
    np.testing.assert_allclose(each, alone, atol=1e-6)
    with pytest.raises(ValueError, match="leading axes"):
        planner.clearance(np.zeros((4, 2)), stacked)


# Reasons


@pytest.mark.parametrize(
    ("joints", "unit"),
    [(None, "0.500 (rad and m)"), (["slide"], "0.500 m"), (["turn"], "0.500 rad")],
)
def test_a_reason_says_what_joints_are_measured_in(joints, unit):
    scene = Scene.from_mjcf(ARM, joints=joints)
    d = len(scene.joints)
    goal = np.append(np.zeros(d - 1), 0.5)
    limits = Limits(-np.ones(d), np.ones(d), np.zeros(d, bool))
    plan = Plan(Status.BUDGET_EXHAUSTED, np.zeros((1, d)), 9, 9, 0.0, "", 0, None)
    goals = Goals(goal[None], 1, None, goal[None][:0])
    nodes = np.array([5, 5])
    asked = Asked(scene, plan, goal, goals, limits, 0.0, nodes, None)
    assert f"is {unit} from" in no_path(asked)
    plan = dataclasses.replace(plan, status=Status.OUT_OF_LIMITS)
    said = no_path(asked._replace(plan=plan, q_start=3 * np.ones(d)))
    kind = scene.joint_kind(scene.joints[0])
    unit = {"slide": "m", "hinge": "rad"}[kind]
    assert f"at 3.0000 {unit}, limits -1.0000 {unit} to 1.0000 {unit}" in said


# Copies


def up(key, q_start, q_goal, count):
    """A sampler that can be pickled: a function of a module."""
    direction = jax.random.normal(key, (count, q_start.size))
    return jaxplan.Segment(direction, jnp.full(count, 0.3))


def copies(thing):
    yield pickle.loads(pickle.dumps(thing))
    yield copy.deepcopy(thing)
    yield copy.copy(thing)


@pytest.mark.parametrize("sampler", [None, up])
@pytest.mark.long
def test_a_used_planner_is_copied_and_answers_alike(scene, sampler):
    limits = {"velocity": [1.0, 2.0], "acceleration": 3.0, "q_min": [-0.9, -1.9]}
    planner = Planner(scene, SMALL, sampler=sampler, **limits)
    answer = planner.plan(LEFT, RIGHT, seed=1)
    timed, clearance = planner.time(answer), planner.clearance(answer.path)
    for same in copies(planner):
        again = same.plan(LEFT, RIGHT, seed=1)
        assert (again.status, again.checks) == (answer.status, answer.checks)
        np.testing.assert_array_equal(again.path, answer.path)
        np.testing.assert_array_equal(same.time(answer).q, timed.q)
        np.testing.assert_array_equal(same.clearance(answer.path), clearance)
        np.testing.assert_array_equal(same.q_min, planner.q_min)


def test_a_sampler_that_cannot_be_pickled_is_pickles_own_error(scene):
    planner = Planner(scene, SMALL, sampler=lambda *_: None)
    with pytest.raises((pickle.PicklingError, AttributeError)):
        pickle.dumps(planner)


def test_scene_world_and_plan_are_copied_whole(scene, planner, answer):
    for name, thing in (
        ("scene", scene),
        ("world", world_for(scene)),
        ("plan", answer),
    ):
        for same in copies(thing):
            assert type(same) is type(thing)
            ours, theirs = jax.tree.leaves(thing), jax.tree.leaves(same)
            if name == "plan":
                ours, theirs = [answer.path, *answer.world], [same.path, *same.world]
                assert (same.status, same.seed) == (answer.status, answer.seed)
            for a, b in zip(ours, theirs, strict=True):
                np.testing.assert_array_equal(a, b)
    same = pickle.loads(pickle.dumps(scene))
    assert (same.joints, same.pairs) == (scene.joints, scene.pairs)
    assert same.mj_model.nq == scene.mj_model.nq
    assert planner.plan(LEFT, RIGHT, 3, world_for(same)).solved


# Processes


def run(code: str, *, interrupt: bool = False, **env: str) -> tuple[int, str, str]:
    """Runs Python; with `interrupt`, sends SIGINT when it has printed a line."""
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | env,
        cwd=Path(jaxplan.__file__).parents[1],
    )
    assert process.stdout is not None
    try:
        line = process.stdout.readline() if interrupt else ""
        if interrupt:
            process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=120)
    finally:
        process.kill()
    return process.returncode, line + out, err


FORKED = f"""
import os, pickle, signal, sys, warnings
import jaxplan
warnings.simplefilter("ignore")
scene = jaxplan.Scene.from_mjcf({ARM!r})
planner = jaxplan.Planner(scene)
kept = pickle.dumps([planner, jaxplan.make_world(scene)])
DOORS = [
    lambda: planner.plan({LEFT}, {RIGHT}),
    lambda: planner.plan_batch([{LEFT}], [{RIGHT}]),
    lambda: planner.clearance({LEFT}),
    lambda: pickle.loads(kept)[0].plan({LEFT}, {RIGHT}, 0, pickle.loads(kept)[1]),
    lambda: jaxplan.make_world(scene),
    lambda: jaxplan.Scene.from_mjcf({ARM!r}),
]
if os.fork():
    sys.exit(os.waitstatus_to_exitcode(os.wait()[1]))
signal.alarm(60)
for door in DOORS:
    try:
        door()
    except RuntimeError as error:
        print(error, flush=True)
os._exit(0)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_child_is_told_to_be_spawned():
    code, out, err = run(FORKED)
    assert code == 0, err
    lines = out.splitlines()
    assert len(lines) == 6
    assert all("spawn" in line for line in lines)


BUSY = {
    "in C, without end": """
    print("busy", flush=True)
    import jax
    jax.jit(lambda x: jax.lax.while_loop(lambda y: y < 2, lambda y: y * 1, x))(1).item()
    """,
    "in threads": """
    from concurrent.futures import ThreadPoolExecutor
    from threading import Event
    with ThreadPoolExecutor(2) as pool:
        print("busy", flush=True)
        list(pool.map(lambda _: Event().wait(), range(2)))
    """,
    "where exceptions are swallowed": """
    import weakref
    class Thing: pass
    print("busy", flush=True)
    while True:
        weakref.finalize(Thing(), sum, range(1000))
    """,
}


@pytest.mark.parametrize("busy", BUSY.values(), ids=BUSY)
def test_ctrl_c_is_one_line_at_once(busy):
    code = f"""
import sys
from jaxplan.cli import CheckCommand, run_script
def main(_):{busy}
sys.argv[1:] = ["robot.xml"]
run_script(main, CheckCommand)
"""
    assert run(code, interrupt=True) == (130, "busy\n", "interrupted\n")


def test_the_command_hears_ctrl_c_while_it_is_imported():
    code = """
    import signal, sys
    for argv in ("-m", "jaxplan", "check"), ("-m", "jaxplan.train"), ("-m", "pytest"):
        sys.orig_argv[:] = "python", *argv
        from jaxplan import interrupt
        print(interrupt.is_command())
    print(signal.getsignal(signal.SIGINT) is signal.default_int_handler)
    """.replace("\n    ", "\n")
    assert run(code) == (0, "True\nTrue\nFalse\nFalse\n", "")
    library = "import jaxplan, signal; print(signal.getsignal(signal.SIGINT))"
    assert "default_int_handler" in run(library)[1]

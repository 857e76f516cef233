"""The planner as a library: what it promises to callers, on an arm of spheres."""

import dataclasses
import re
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan import Obstacle, Planner, PlannerConfig, Scene, Segment, Status, make_world
from jaxplan.collision import clearance_mujoco
from jaxplan.collision.touching import random_poses

ARM = """
<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default><joint axis="0 1 0" range="-2.2 2.2"/><geom type="sphere"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="2 2 0.1"/>
    <geom name="post" type="box" size="0.05 0.05 0.25" pos="0.35 0 0.25"/>
    <body name="shoulder" pos="0 0 0.15">
      <joint name="turn" axis="0 0 1" range="-3 3"/>
      <geom name="drum" size="0.07"/>
      <body name="upper_arm" pos="0 0 0.1">
        <joint name="lift"/>
        <geom name="upper_0" size="0.05" pos="0 0 0.1"/>
        <geom name="upper_1" size="0.05" pos="0 0 0.18"/>
        <body name="forearm" pos="0 0 0.3">
          <joint name="elbow"/>
          <geom name="fore_0" size="0.045" pos="0 0 0.06"/>
          <geom name="fore_1" size="0.045" pos="0 0 0.14"/>
          <body name="hand" pos="0 0 0.25">
            <joint name="wrist"/>
            <geom name="palm" size="0.04" pos="0 0 0.03"/>
          </body>
        </body>
      </body>
    </body>
    <body name="ball" pos="-0.5 0.5 0.06"><freejoint/><geom name="ball" size="0.05"/></body>
    <body name="pea" pos="-0.5 -0.5 0.04"><freejoint/><geom name="pea" size="0.03"/></body>
  </worldbody>
</mujoco>
"""
LEFT = np.array([0.9, 0.9, 0.9, 0.4])
RIGHT = np.array([-0.9, 0.9, 0.9, 0.4])
PALM_AT_LEFT = (0.31, 0.39, 0.36, 1, 0, 0, 0)
INTO_POST = np.array([0.0, 0.9, 0.9, 0.4])
FAR_AWAY = np.array([-0.5, 0.5, 0.06, 1, 0, 0, 0])
IN_HAND = np.array([0, 0, 0.13, 1, 0, 0, 0])
DEEPER = np.array([0, 0, 0.23, 1, 0, 0, 0])
CONFIG = PlannerConfig(max_expansions=2000)
VELOCITY, ACCELERATION = 1.5, 3.0


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_mjcf(ARM, slots={"box": 2, "sphere": 2})


@pytest.fixture(scope="module")
def planner(scene: Scene) -> Planner:
    return Planner(scene, CONFIG, velocity=VELOCITY, acceleration=ACCELERATION)


@pytest.fixture(scope="module")
def questions(scene: Scene, planner: Planner) -> tuple[np.ndarray, np.ndarray]:
    """Starts and goals `[32, d]`, all free by C MuJoCo."""
    q = random_poses(scene, 400)
    free = q[clearance_mujoco(scene, planner.empty_world, q) > 0.01]
    return free[:32], free[32:64]


@pytest.fixture(scope="module")
def answers(planner: Planner, questions):
    return planner.plan_batch(*questions)


@pytest.fixture
def compilations() -> Iterator[list[str]]:
    """Grows by one for everything that XLA compiles."""
    heard: list[str] = []

    def listen(event: str, *_, **__) -> None:
        if "backend_compile" in event:
            heard.append(event)

    jax.monitoring.register_event_duration_secs_listener(listen)
    yield heard
    jax.monitoring.unregister_event_duration_listener(listen)


def same(a, b) -> bool:
    return (a.status, a.expansions, a.checks) == (
        b.status,
        b.expansions,
        b.checks,
    ) and np.array_equal(a.path, b.path)


def test_every_answer_is_solved_and_certified(planner, questions, answers):
    for start, goal, answer in zip(*questions, answers, strict=True):
        assert answer.solved
        assert answer.reason == ""
        np.testing.assert_allclose(answer.path[[0, -1]], [start, goal], atol=1e-6)
        certificate = planner.certify(answer)
        assert certificate.valid
        assert certificate.clearance > 0
    assert sum(len(answer.path) > 2 for answer in answers) > 5
    # Planned without a margin, so that not each is free between its samples.
    proofs = [planner.certify(answer, continuous=True) for answer in answers]
    assert sum(bool(proof.proven) for proof in proofs) > len(proofs) / 2
    assert all(proof.valid == proof.proven for proof in proofs)


def test_alone_or_in_any_batch_the_answer_is_the_same(planner, questions, answers):
    starts, goals = questions
    for row in range(0, 32, 5):
        assert same(planner.plan(starts[row], goals[row], seed=row), answers[row])
    for rows in ([7], [3, 1, 2], [5] * 9 + [30], list(range(16))[::-1]):
        batch = planner.plan_batch(starts[rows], goals[rows], seeds=rows)
        assert all(
            same(answer, answers[row]) for row, answer in zip(rows, batch, strict=True)
        )


def test_another_seed_is_another_search(planner):
    answers = planner.plan_batch([LEFT] * 4, [RIGHT] * 4, seeds=[1, 1, 2, 3])
    assert same(answers[0], answers[1])
    assert not same(answers[1], answers[2])
    assert not same(answers[2], answers[3])


def test_no_questions_have_no_answers(planner):
    assert planner.plan_batch(np.zeros((0, 4)), np.zeros((0, 4))) == []


@pytest.mark.parametrize(
    ("start", "goal", "status", "words"),
    [
        (INTO_POST, RIGHT, Status.START_IN_COLLISION, "start in collision: .*post.* deep"),
        (LEFT, INTO_POST, Status.GOAL_IN_COLLISION, "goal in collision: .*post.* deep"),
        ([3.2, 0, 0, 0], LEFT, Status.OUT_OF_LIMITS, "start .*'turn' at 3.2000.* 3.0000"),
        (LEFT, [0, 0, -9, 0], Status.OUT_OF_LIMITS, "goal .*'elbow' at -9.0000"),
        ([0, np.nan, 0, 0], LEFT, Status.INVALID_INPUT, "start .*'lift' is nan"),
        (LEFT, [0, 0, 0, np.inf], Status.INVALID_INPUT, "goal .*'wrist' is inf"),
    ],
)  # fmt: skip
def test_a_question_without_an_answer_gets_a_reason(
    planner, start, goal, status, words
):
    answer = planner.plan(start, goal)
    assert answer.status == status
    assert not answer.solved
    assert_matches(words, answer.reason)
    with pytest.raises(ValueError, match="no motion to time"):
        planner.time(answer)


def test_the_depth_in_a_reason_is_that_of_c_mujoco(planner, scene):
    reason = planner.plan(INTO_POST, LEFT).reason
    depth = -1000 * clearance_mujoco(scene, planner.empty_world, INTO_POST)
    assert f", {depth:.2f} mm deep" in reason


def test_a_budget_that_is_used_up_says_how_near_it_came(planner, scene):
    # A wall through the axis from one end to the other: nothing leads around it.
    walls = [Obstacle("box", (0.5, 0.02, 0.6), (x, 0, 0.6)) for x in (-0.6, 0.6)]
    top = Obstacle("sphere", (0.1,), (0, 0, 0.45))
    here, there = [1.4, 0.9, 0.9, 0.4], [-1.4, 0.9, 0.9, 0.4]
    answer = planner.plan(here, there, world=make_world(scene, obstacles=[*walls, top]))
    assert answer.status == Status.BUDGET_EXHAUSTED
    assert answer.expansions == CONFIG.max_expansions
    gap = np.linalg.norm(answer.path[-1] - there)
    assert_matches(f"after 2000 expansions.* {gap:.3f} rad", answer.reason)
    assert planner.certify(answer).valid


def test_obstacles_move_without_a_compilation(planner, scene, compilations):
    def world_with(*obstacles: Obstacle):
        return make_world(scene, obstacles=obstacles)

    planner.plan(LEFT, RIGHT, world=world_with())
    wall = Obstacle("box", (0.1, 0.1, 0.1), PALM_AT_LEFT)
    compilations.clear()
    verdicts = []
    for obstacles in (
        [wall],
        [Obstacle("sphere", (0.1,), PALM_AT_LEFT[:3])],
        [wall, wall],
        [],
    ):
        answer = planner.plan(LEFT, RIGHT, world=world_with(*obstacles))
        verdicts.append(answer.status)
        assert not obstacles or f"{obstacles[0].kind}0" in answer.reason
    assert verdicts == [Status.START_IN_COLLISION] * 3 + [Status.SOLVED]
    assert compilations == []


def test_worlds_for_all_one_each_or_stacked(planner, scene, questions):
    starts, goals = (q[:6] for q in questions)
    worlds = [
        make_world(scene, obstacles=[Obstacle("box", (0.05, 0.05, 0.2), (x, 0.3, 0.2))])
        for x in np.linspace(-0.4, 0.4, 6)
    ]
    each = planner.plan_batch(starts, goals, worlds=worlds)
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *worlds)
    only_slots = worlds[0]._replace(slot_pose=stacked.slot_pose)
    for other in (stacked, only_slots):
        again = planner.plan_batch(starts, goals, worlds=other)
        assert all(map(same, each, again))
    for row, answer in enumerate(each):
        alone = planner.plan(starts[row], goals[row], row, worlds[row])
        assert same(answer, alone)
        assert not answer.solved or planner.certify(answer, worlds[row]).valid
        np.testing.assert_array_equal(answer.world.slot_pose, worlds[row].slot_pose)
    for_all = planner.plan_batch(starts, goals, worlds=worlds[2])
    assert same(for_all[2], each[2])


def test_a_held_object_collides_until_it_is_released(planner, scene):
    # Low over the floor: the palm passes, the ball in front of it does not.
    low = np.array([1.5, 1.35, 0.9, 0.4])
    free = planner.plan(LEFT, low)
    assert free.solved
    carrying = make_world(
        scene, object_pose=[IN_HAND, FAR_AWAY * [1, -1, 1, 1, 1, 1, 1]], held=[True, False]
    )  # fmt: skip
    refused = planner.plan(LEFT, low, world=carrying)
    assert refused.status == Status.GOAL_IN_COLLISION
    assert_matches("ball and floor|floor and ball", refused.reason)
    around = planner.plan(LEFT, RIGHT, world=carrying)
    assert around.solved
    assert planner.certify(around).valid
    both = make_world(
        scene, object_pose=[IN_HAND, DEEPER], held=[True, True]
    )  # fmt: skip
    assert planner.clearance(low, both) < planner.clearance(low, carrying) < 0
    # Set down again: it stays where it is put, and the arm is free of it.
    released = carrying._replace(
        object_pose=make_world(scene).object_pose, held=[False] * 2
    )
    assert planner.plan(LEFT, low, world=released).solved


def test_an_object_that_stands_in_the_way_is_an_obstacle(planner, scene):
    world = make_world(scene, object_pose=[PALM_AT_LEFT, FAR_AWAY])
    answer = planner.plan(LEFT, RIGHT, world=world)
    assert answer.status == Status.START_IN_COLLISION
    assert "ball" in answer.reason


@pytest.mark.parametrize("speed", [1.0, 0.4])
def test_a_timed_motion_keeps_limits_and_ends_at_rest(planner, answers, scene, speed):
    for answer in answers[:6]:
        timed = planner.time(answer, speed)
        assert timed.free
        assert np.all(np.abs(timed.qd) <= speed * VELOCITY + 1e-6)
        assert np.all(np.abs(timed.qdd) <= speed**2 * ACCELERATION + 1e-5)
        np.testing.assert_allclose(timed.qd[[0, -1]], 0, atol=1e-6)
        np.testing.assert_allclose(timed.q[[0, -1]], answer.path[[0, -1]], atol=1e-5)
        steps = np.diff(timed.t)
        assert timed.t[0] == 0
        assert np.all(steps > 0)
        # The velocities are those of the positions.
        moved = np.diff(timed.q, axis=0) / steps[:, None]
        np.testing.assert_allclose(moved, (timed.qd[1:] + timed.qd[:-1]) / 2, atol=0.02)
        assert planner.certify(timed.q, answer.world).valid
        low, high = np.asarray(scene.q_min), np.asarray(scene.q_max)
        assert np.all((timed.q >= low - 1e-5) & (timed.q <= high + 1e-5))
        # The limits are used, one of them or the other.
        used = np.abs(timed.qd).max() / (speed * VELOCITY)
        push = np.abs(timed.qdd).max() / (speed**2 * ACCELERATION)
        assert max(used, push) > 0.98


def test_shortened_paths_are_no_longer_and_as_free(planner, answers):
    unsolved = planner.plan(LEFT, INTO_POST)
    found = planner.shorten([*answers, unsolved])
    assert found[-1] is unsolved
    for before, after in zip(answers, found, strict=False):
        np.testing.assert_array_equal(after.path[[0, -1]], before.path[[0, -1]])
        assert after.length <= before.length + 1e-5
        assert planner.certify(after).valid
    assert sum(x.length for x in found[:-1]) < 0.95 * sum(x.length for x in answers)
    (alone,) = planner.shorten(answers[3:4])
    np.testing.assert_array_equal(alone.path, found[3].path)
    assert planner.shorten([]) == []
    with pytest.raises(ValueError, match="plans"):
        planner.shorten(["no plan"])


def test_a_sampler_of_ones_own_guides_the_search(scene):
    asked = []

    def over_the_top(key, q_start, q_goal, count):
        """Up, across and down again, with some noise."""
        asked.append((q_start.shape, q_goal.shape, count))
        noise = 0.3 * jax.random.normal(key, (count, q_start.size))
        up = jnp.where(jnp.arange(count)[:, None] % 2, q_goal - q_start, -q_start)
        return Segment(up + noise, jnp.full(count, 0.5))

    planner = Planner(
        scene, dataclasses.replace(CONFIG, p_uniform=0.0), sampler=over_the_top
    )
    answers = [planner.plan(LEFT, RIGHT, seed=4) for _ in range(2)]
    assert answers[0].solved
    assert same(*answers)
    assert planner.certify(answers[0]).valid
    assert asked
    assert asked[0][:2] == ((4,), (4,))


@pytest.mark.parametrize("method", ["rrt", "rrt_connect", "ao_rrt_connect"])
@pytest.mark.parametrize("beyond", ["end", "base"])
@pytest.mark.long
def test_a_sampler_cannot_lead_out_of_the_limits(scene, method, beyond):
    """Its segments end, or begin, beyond them; trees take one or the other for where to go."""

    def out(key, q_start, q_goal, count):
        base = 3.5 * jax.random.normal(key, (count, 4))
        way = jax.random.normal(jax.random.fold_in(key, 1), (count, 4))
        segment = Segment(way, jnp.full(count, 0.7), base)
        return segment if beyond == "end" else segment.reversed()

    config = PlannerConfig(method=method, max_expansions=1500, p_uniform=0.1)
    planner = Planner(scene, config, sampler=out)
    starts, goals = np.stack([LEFT] * 8), np.stack([RIGHT] * 8)
    plans = planner.plan_batch(starts, goals)
    for plan in plans:  # unsolved ones end at the node nearest to the goal
        assert (plan.path >= planner.q_min).all()
        assert (plan.path <= planner.q_max).all()
        assert planner.certify(plan).valid
    assert sum(plan.solved for plan in plans) > 4


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, 1e30])
def test_a_broken_sampler_cannot_spoil_planning(broken, value):
    planner, setting = broken
    answer = planner.plan([*LEFT[:3], setting[value]], RIGHT)
    assert answer.solved
    assert planner.certify(answer).valid


@pytest.fixture(scope="module", params=[False, True], ids=["", "with bases"])
def broken(scene, request):
    """A planner whose sampler gives something useless, chosen by the start's wrist."""
    values = [np.nan, np.inf, 0.0, 1e30]
    wrists = np.array([0.1, 0.2, 0.3, 0.4])

    def sampler(key, q_start, q_goal, count):
        value = jnp.array(values)[jnp.abs(wrists - q_start[3]).argmin()]
        many = jnp.full((count, 4), value)
        return Segment(many, jnp.full(count, value), many if request.param else None)

    planner = Planner(scene, CONFIG, sampler=sampler)
    return planner, dict(zip(values, wrists, strict=True))


@pytest.mark.parametrize("wrong", ["direction", "length", "base"])
def test_a_sampler_of_the_wrong_shape_is_named(scene, wrong):
    def sampler(key, q_start, q_goal, count):
        many = jnp.zeros((count, 4))
        return Segment(many, many[:, 0], many)._replace(**{wrong: jnp.zeros((3, 4))})

    planner = Planner(scene, CONFIG, sampler=sampler)
    with pytest.raises(ValueError, match=rf"sampler's {wrong} has shape \(3, 4\)"):
        planner.plan(LEFT, RIGHT)


def test_nothing_bad_is_ever_solved(planner, scene):
    """A thousand bad questions of every kind: an error of the door, or a status."""
    rng = np.random.default_rng(0)
    q = random_poses(scene, 3000, seed=1)
    clearance = clearance_mujoco(scene, planner.empty_world, q)
    good, colliding = q[clearance > 0.01], q[clearance < -0.001]
    rows = 800
    ends = good[rng.integers(len(good), size=(rows, 2))].astype(float)
    for row in range(rows):
        end, joint = rng.integers(2), rng.integers(4)
        if row % 8 == 0:
            ends[row, end] = colliding[rng.integers(len(colliding))]
        else:
            limits = 3.0 if joint == 0 else 2.2
            beyond = rng.choice([-1, 1]) * (limits + 10 ** rng.uniform(-3, 3))
            bad = [np.nan, np.inf, -np.inf, 1e30, -1e30, 1e39, beyond]
            ends[row, end, joint] = bad[row % 8 - 1]
    batches = [
        planner.plan_batch(*ends[i : i + 32].swapaxes(0, 1)) for i in range(0, rows, 32)
    ]
    statuses = [answer.status for batch in batches for answer in batch]
    assert Status.SOLVED not in statuses
    assert Status.BUDGET_EXHAUSTED not in statuses
    assert {Status.OUT_OF_LIMITS, Status.INVALID_INPUT} < set(statuses)

    world = planner.empty_world
    bad_q = (
        None, "home", "0.1,0.2", {}, [], object(), 1.0, True, np.zeros(3), np.zeros(5),
        np.zeros((1, 4)), np.zeros((4, 1)), [None] * 4, ["a"] * 4, [[1], 2, 3, 4],
        np.full(4, 1j), [np.nan] * 4, [1e30] * 4, [10**400, 0, 0, 0],
    )  # fmt: skip
    bad_worlds = (
        "world", 3, [world], tuple(world), world._replace(held=None),
        world._replace(passive=np.zeros(7)),
        world._replace(object_pose=np.full((2, 7), np.nan)),
        world._replace(object_pose=np.zeros((2, 7))),
        world._replace(object_pose=np.zeros((3, 7))),
        world._replace(slot_pose="abc"),
        world._replace(slot_pose=np.full((4, 7), np.inf)),
        world._replace(slot_size=np.full((4, 3), -1.0)),
        world._replace(slot_size=np.full((4, 3), np.nan)),
        world._replace(slot_size=np.ones((5, 4, 3))),
    )  # fmt: skip
    bad_seeds = (-1, 2**32, 1.5, "0", None, np.nan)
    for _ in range(200):
        question = [good[0], good[1], 0, world]
        kinds = (bad_q, bad_q, bad_seeds, bad_worlds)
        for place in {int(rng.integers(4)), int(rng.integers(4))}:
            values = kinds[place]
            question[place] = values[rng.integers(len(values))]
        try:
            status = planner.plan(*question).status
        except ValueError:
            continue
        assert status not in (Status.SOLVED, Status.BUDGET_EXHAUSTED), question


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"velocity": 0}, "velocity 0"),
        ({"velocity": [1, 2]}, "velocity"),
        ({"acceleration": np.nan}, "acceleration nan"),
        ({"q_min": 1.0, "q_max": 0.0}, "q_min < q_max"),
    ],
)
def test_settings_that_make_no_sense_are_refused(scene, settings, words):
    with pytest.raises(ValueError, match=words):
        Planner(scene, CONFIG, **settings).plan(LEFT, RIGHT)


@pytest.mark.parametrize("speed", [0, -1, np.nan, np.inf])
def test_a_speed_that_makes_no_sense_is_refused(planner, answers, speed):
    with pytest.raises(ValueError, match="speed"):
        planner.time(answers[0], speed)


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle("box", (0.1,), (0, 0, 0)),
        Obstacle("sphere", (0.1,), (0, 0)),
        Obstacle("cone", (0.1,), (0, 0, 0)),
    ],
)
def test_an_obstacle_that_makes_no_sense_is_refused(scene, obstacle):
    with pytest.raises(ValueError, match=r"slot|expected"):
        make_world(scene, obstacles=[obstacle])


def assert_matches(pattern: str, text: str) -> None:
    assert re.search(pattern, text), text

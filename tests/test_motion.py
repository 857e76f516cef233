"""Planned motions: where they begin and end, their limits, and what C MuJoCo says of them."""

import jax
import numpy as np
import pytest

from jaxplan import collision
from jaxplan.config import EXECUTED_TRAJECTORY, PlannerConfig
from jaxplan.motion.executable import NEAR
from jaxplan.planning import Status
from jaxplan.robots import PANDA
from jaxplan.robots.kinematics import InverseKinematics

SPEED = np.array([1.0, 0.5, 1.0, 1.0])
FREE, GOAL_INSIDE, START_INSIDE, HOPELESS = range(4)


@pytest.fixture(scope="module")
def worlds(mug_task):
    """Four mugs that lie in the range."""
    mug_task.reset(range(4), range(4))
    return mug_task.worlds(np.zeros(4, bool))


@pytest.fixture(scope="module")
def problems(mug_task, mug_planner, worlds):
    """Starts and goals [4, 7]; the table is what some of them lie in."""
    ik = InverseKinematics(PANDA, mug_task.model)
    _, down = ik.pose(PANDA.q_home)

    def above(x: float, y: float, z: float) -> np.ndarray:
        return ik.solve(np.array([x, y, z]), down, PANDA.q_home)[0]

    def sunk(lane: int, high: np.ndarray, low: np.ndarray) -> np.ndarray:
        """On the way from high to low, the first place that is 2 mm deep."""
        way = high + np.linspace(0, 1, 400)[:, None] * (low - high)
        world = jax.tree.map(lambda leaf: leaf[lane], worlds)
        clearance = collision.clearance_mujoco(mug_planner.scene, world, way)
        return way[np.argmax(clearance < -0.002)]

    left, right = above(0.5, 0.3, 0.15), above(0.5, -0.25, 0.2)
    inside = sunk(GOAL_INSIDE, left, above(0.5, 0.3, -0.05))
    start = np.stack([PANDA.q_home, PANDA.q_home, inside, PANDA.q_home])
    goal = np.stack([left, inside, right, above(0.5, 0.3, -0.08)])
    return start, goal


@pytest.fixture(scope="module")
def motion(mug_planner, worlds, problems):
    keys = jax.random.split(jax.random.key(0), 4)
    start, goal = problems
    return mug_planner.plan(worlds, start, goal, goal, keys, speed=SPEED)


@pytest.fixture
def clearance(mug_planner, worlds):
    def of(lane: int, q: np.ndarray) -> float:
        world = jax.tree.map(lambda leaf: leaf[lane], worlds)
        return float(collision.clearance_mujoco(mug_planner.scene, world, q))

    return of


def test_commands_lead_from_start_to_goal(motion, problems):
    start, goal = problems
    assert motion.result.status[FREE] == Status.SOLVED
    np.testing.assert_allclose(motion.q[FREE][0], start[FREE], atol=1e-6)
    np.testing.assert_allclose(motion.q[FREE][-1], goal[FREE], atol=1e-6)


def test_a_goal_a_hair_inside_an_obstacle_is_replaced(motion, problems, clearance):
    end, goal = motion.q[GOAL_INSIDE][-1], problems[1][GOAL_INSIDE]
    assert clearance(GOAL_INSIDE, goal) < 0
    assert motion.result.status[GOAL_INSIDE] == Status.SOLVED
    assert 0 < np.linalg.norm(end - goal) <= NEAR
    assert clearance(GOAL_INSIDE, end) > PlannerConfig().margin - 1e-4


def test_a_start_in_collision_gets_a_straight_way_out(motion, problems, clearance):
    start, goal = (q[START_INSIDE] for q in problems)
    assert clearance(START_INSIDE, start) < 0
    q, first = motion.q[START_INSIDE], motion.result.path[START_INSIDE, 0]
    assert clearance(START_INSIDE, first) > PlannerConfig().margin - 1e-4
    out = int(np.argmin(np.linalg.norm(q - first, axis=1)))
    np.testing.assert_allclose(q[0], start, atol=1e-6)
    share = np.linalg.norm(q[: out + 1] - q[0], axis=1) / np.linalg.norm(first - q[0])
    straight = q[0] + share[:, None] * (first - q[0])
    np.testing.assert_allclose(q[: out + 1], straight, atol=1e-5)
    np.testing.assert_allclose(q[-1], goal, atol=1e-6)


def test_a_goal_deep_inside_is_refused_and_named(motion, mug_planner, worlds, problems):
    goal = problems[1][HOPELESS]
    assert motion.result.status[HOPELESS] == Status.GOAL_IN_COLLISION
    assert len(motion.q[HOPELESS]) == 0
    reason = mug_planner.reason(worlds, HOPELESS, goal)
    assert "table" in reason
    assert "-" in reason.split(", ")[1], "a depth is a negative distance"


def test_nothing_near_is_said_so(mug_planner, worlds):
    free = jax.tree.map(np.copy, worlds)._replace(ignored=np.ones_like(worlds.ignored))
    assert mug_planner.reason(free, 0, PANDA.q_home) == "nothing"


@pytest.mark.parametrize("lane", [FREE, GOAL_INSIDE, START_INSIDE])
def test_commands_obey_the_limits(motion, mug_planner, lane):
    """A lane's speed scales velocities, and its square accelerations."""
    config, limits = EXECUTED_TRAJECTORY, mug_planner.limits
    share = 1.0, 1.0  # the way out of a collision uses the limits whole
    if lane != START_INSIDE:
        share = config.velocity_scale, config.acceleration_scale
    # As the simulator drives it: at rest before and after.
    q = np.pad(motion.q[lane], ((2, 2), (0, 0)), mode="edge")
    velocity = np.diff(q, axis=0) / config.control_period
    acceleration = np.diff(velocity, axis=0) / config.control_period
    slow = 1 + 1e-3
    assert np.all(abs(velocity) <= slow * share[0] * SPEED[lane] * limits.velocity)
    most = share[1] * SPEED[lane] ** 2 * limits.acceleration
    assert np.all(abs(acceleration) <= slow * most)
    assert np.all(q >= limits.q_min)
    assert np.all(q <= limits.q_max)


@pytest.mark.parametrize("lane", [FREE, GOAL_INSIDE, START_INSIDE])
def test_motions_are_certified_by_mujoco(motion, mug_planner, worlds, lane):
    world = jax.tree.map(lambda leaf: leaf[lane], worlds)
    first = motion.result.path[lane, 0]
    q = motion.q[lane]
    after = q[int(np.argmin(np.linalg.norm(q - first, axis=1))) :]
    certificate = collision.certify(mug_planner.scene, world, after)
    assert certificate.valid, certificate


@pytest.mark.parametrize("bad", [np.nan, np.inf, 7.0])
def test_bad_joints_get_a_status_and_no_motion(mug_planner, worlds, problems, bad):
    start, goal = (q.copy() for q in problems)
    start[0, 2] = goal[1, 4] = bad
    keys = jax.random.split(jax.random.key(0), 4)
    active = np.arange(4) < 2
    motion = mug_planner.plan(worlds, start, goal, goal, keys, active=active)
    out_of = Status.OUT_OF_LIMITS if np.isfinite(bad) else Status.INVALID_INPUT
    assert motion.result.status.tolist() == [out_of] * 2 + [Status.INACTIVE] * 2
    assert [len(q) for q in motion.q] == [0] * 4

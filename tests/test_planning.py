"""The batched planner against a sequential NumPy one, and the laws of a search tree."""

from dataclasses import replace
from functools import cache
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_spheres import (
    Q_MAX,
    Oracle,
    Spheres,
    config_free,
    motion_free,
    noisy_sampler,
    problems,
)

from jaxplan.config import PlannerConfig
from jaxplan.planning import Segment, Status, make_planner

METHODS = ("rrt", "rrt_connect")
LITERAL = PlannerConfig(
    method="rrt", goal_connect=0.0, goal_bias=0.0, uniform_mode="independent"
)


@cache
def planner(config, d=7):
    limit = np.full(d, Q_MAX)
    return make_planner(motion_free, config_free, config, -limit, limit)


def assert_same_search(a, b):
    """Same parents, flags and counts; configurations within 1e-6 rad."""
    for name in ("status", "expansions", "accepted", "learned", "flags", "path_length"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)
    np.testing.assert_array_equal(a.tree.parent, b.tree.parent)
    np.testing.assert_array_equal(a.tree.side, b.tree.side)
    np.testing.assert_array_equal(a.tree.size, b.tree.size)
    np.testing.assert_allclose(a.tree.q, b.tree.q, rtol=0, atol=1e-6)
    np.testing.assert_allclose(a.path, b.path, rtol=0, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_any_number_of_proposals_gives_the_tree_of_one(method):
    """200 problems: checking 16 motions at a time changes nothing but the speed."""
    worlds, q_start, q_goal, keys = problems(200, seed=1)
    draw = noisy_sampler(q_start, q_goal, keys)
    config = PlannerConfig(method=method, max_expansions=120)
    args = (worlds, q_start, q_goal, q_goal, keys, draw)
    one = planner(replace(config, proposals=1))(*args)
    many = planner(replace(config, check_rows=200 * 16))(*args)
    assert_same_search(one, many)
    # with room for fewer rows each problem has fewer proposals, the last ones more
    assert_same_search(one, planner(config)(*args))
    rejected = np.asarray(one.expansions - one.accepted)
    assert np.sum(one.status == Status.SOLVED) > 5
    assert np.sum(rejected > 2) > 100


ORACLE_CONFIGS = {
    "rrt": PlannerConfig(method="rrt"),
    "rrt, literal": LITERAL,
    "rrt, other settings": PlannerConfig(
        method="rrt",
        metric=(1, 1, 0.9, 0.9, 0.6, 0.5, 0.3),
        toggle_tie_break=0.1,
        goal_tolerance=0.2,
    ),
    "rrt_connect": PlannerConfig(),
    "rrt_connect, other settings": PlannerConfig(
        uniform_mode="independent",
        goal_tree="uniform",
        toggle_tie_break=0.2,
        p_uniform=0.6,
    ),
}


@pytest.mark.parametrize("config", ORACLE_CONFIGS.values(), ids=ORACLE_CONFIGS.keys())
def test_batched_search_is_the_sequential_one(config):
    """A plain NumPy planner, fed the same random numbers, grows the same trees."""
    config = replace(config, max_expansions=100)
    count = 24
    worlds, q_start, q_goal, keys = problems(count, seed=2)
    q_toggle = q_goal + 0.3
    draw = noisy_sampler(q_start, q_goal, keys)
    result = planner(config)(worlds, q_start, q_goal, q_toggle, keys, draw)
    result = jax.tree.map(np.asarray, result)
    chunks = [draw(jnp.full(count, c)) for c in range(100 // 8 + 1)]
    for p in range(count):
        segments = Segment(
            jnp.concatenate([c.direction[p] for c in chunks]),
            jnp.concatenate([c.length[p] for c in chunks]),
        )
        world = Spheres(worlds.centre[p], worlds.radius[p])
        oracle = Oracle(
            world, q_start[p], q_goal[p], q_toggle[p], keys[p], segments, config
        )
        solved = getattr(oracle, config.method)()
        size = len(oracle.q)
        assert (result.status[p] == Status.SOLVED) == solved
        assert result.expansions[p] == len(oracle.flags)
        assert result.learned[p] == oracle.used
        assert result.tree.size[p] == size
        np.testing.assert_array_equal(result.tree.parent[p, :size], oracle.parent)
        np.testing.assert_array_equal(result.tree.side[p, :size], oracle.side)
        flags = result.flags[p, : len(oracle.flags)]
        np.testing.assert_array_equal(flags, oracle.flags)
        np.testing.assert_allclose(result.tree.q[p, :size], oracle.q, atol=1e-5)


@pytest.fixture(scope="module", params=METHODS)
def searched(request):
    """A planner of 32 lanes in the plane, with many obstacles."""
    config = PlannerConfig(method=request.param, max_expansions=200, proposals=8)
    return config, planner(config, d=2)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=8)
def test_every_result_is_a_tree_and_a_free_path(searched, seed):
    """Parents precede children, edges are free and short, the path runs start to end."""
    config, plan = searched
    worlds, q_start, q_goal, keys = problems(32, d=2, spheres=6, seed=seed)
    draw = noisy_sampler(q_start, q_goal, keys)
    result = plan(worlds, q_start, q_goal, q_goal, keys, draw)
    result = jax.tree.map(np.asarray, result)
    assert np.all(np.isfinite(result.tree.q))
    assert np.all(np.abs(result.tree.q) <= Q_MAX)
    assert np.all(result.expansions <= config.max_expansions)
    assert np.all(result.accepted == np.sum(result.flags, axis=1))
    for p in range(32):
        size = result.tree.size[p]
        q, parent = result.tree.q[p, :size], result.tree.parent[p, :size]
        assert np.all(parent < np.arange(size))
        edges = np.flatnonzero(parent >= 0)
        assert len(edges) == result.accepted[p]
        assert_free(worlds, p, q[parent[edges]], q[edges], config.step_max)
        if result.status[p] > Status.BUDGET_EXHAUSTED:
            assert result.path_length[p] == 0
            continue
        length = result.path_length[p]
        path, rest = np.split(result.path[p], [length])
        assert_free(worlds, p, path[:-1], path[1:], config.step_max)
        np.testing.assert_array_equal(path[0], q_start[p])
        assert np.all(rest == path[-1])
        gap = np.linalg.norm(path[-1] - q_goal[p])
        if result.status[p] == Status.BUDGET_EXHAUSTED:
            tree = q[result.tree.side[p, :size] == 0]
            reached = np.linalg.norm(tree - q_goal[p], axis=-1)
            assert gap == pytest.approx(reached.min())
        elif config.method == "rrt_connect":
            np.testing.assert_array_equal(path[-1], q_goal[p])
        else:
            assert gap <= config.goal_tolerance


def assert_free(worlds, problem, q0, q1, step_max):
    """Motions of problem `problem` are free and no longer than a step."""
    # room for the rounding of a verdict that was computed by another program
    worlds = worlds._replace(radius=worlds.radius - 1e-5)
    assert np.all(motion_free(worlds, np.full(len(q0), problem), q0, q1))
    assert np.all(np.linalg.norm(q1 - q0, axis=-1) <= step_max * 1.001)


@pytest.mark.parametrize("method", METHODS)
def test_results_do_not_depend_on_the_batch(method):
    """A problem has the same answer alone, in company, elsewhere in it, and padded."""
    worlds, q_start, q_goal, keys = problems(12, seed=3)
    plan = planner(PlannerConfig(method=method, max_expansions=60, proposals=8))

    def run(lanes, active=None):
        lanes = np.asarray(lanes)
        part = jax.tree.map(lambda x: x[lanes], (worlds, q_start, q_goal, keys))
        draw = noisy_sampler(part[1], part[2], part[3])
        return plan(part[0], part[1], part[2], part[2], part[3], draw, active)

    def lanes_of(result, lanes):
        return jax.tree.map(lambda x: np.asarray(x)[np.asarray(lanes)], result)

    whole = run(range(12))
    assert_same_search(lanes_of(whole, [5]), run([5]))
    order = np.random.default_rng(0).permutation(12)
    assert_same_search(lanes_of(whole, order), run(order))
    active = np.arange(12) < 4
    padded = run(range(12), active)
    assert_same_search(lanes_of(whole, range(4)), lanes_of(padded, range(4)))
    assert np.all(padded.status[4:] == Status.INACTIVE)
    assert np.all(padded.expansions[4:] == 0)
    assert np.all(padded.path_length[4:] == 0)


def small(method: Literal["rrt", "rrt_connect"] = "rrt_connect"):
    """One planner for the tests that need nothing special: 16 lanes, 60 expansions."""
    return planner(PlannerConfig(method=method, max_expansions=60, proposals=8))


def test_p_uniform_1_is_plain_rrt():
    """With p_uniform = 1 the sampler is never asked, and the tree is that of no sampler."""
    worlds, q_start, q_goal, keys = problems(16, seed=4)

    def never(chunk):
        raise AssertionError("asked")

    plan = planner(PlannerConfig(max_expansions=60, proposals=8, p_uniform=1.0))
    uniform = plan(worlds, q_start, q_goal, q_goal, keys, never)
    assert_same_search(uniform, small()(worlds, q_start, q_goal, q_goal, keys))
    assert np.all(uniform.learned == 0)


def _constant(q_start, q_goal):
    return np.broadcast_to(np.eye(7)[0], q_start.shape), 0.2


def _nan(q_start, q_goal):
    return np.full_like(q_start, np.nan), np.nan


def _nan_length(q_start, q_goal):
    return q_goal - q_start, np.nan


def _zero(q_start, q_goal):
    return np.zeros_like(q_start), 0.0


def _away(q_start, q_goal):
    return q_start - q_goal, 0.2


@pytest.mark.parametrize("sampler", [_constant, _nan, _nan_length, _zero, _away])
def test_no_sampler_can_spoil_completeness(sampler):
    """Whatever the sampler returns, 20 % uniform proposals solve every problem."""
    worlds, q_start, q_goal, keys = problems(100, seed=5)
    direction, length = sampler(q_start, q_goal)
    direction = np.broadcast_to(direction[:, None], (100, 32, 7))
    bank = Segment(jnp.asarray(direction), jnp.full((100, 32), length))
    plan = planner(PlannerConfig(max_expansions=2000, p_uniform=0.2, proposals=8))
    result = plan(worlds, q_start, q_goal, q_goal, keys, lambda chunk: bank)
    assert np.all(result.status == Status.SOLVED), np.bincount(result.status)
    assert np.all(np.isfinite(result.tree.q))


def test_a_broken_sampler_leaves_plain_rrt():
    """Segments that are no move give way to the uniform proposal of their expansion."""
    worlds, q_start, q_goal, keys = problems(16, seed=6)
    bank = Segment(jnp.full((16, 8, 7), jnp.nan), jnp.ones((16, 8)))
    plan = small()
    broken = plan(worlds, q_start, q_goal, q_goal, keys, lambda chunk: bank)
    plain = plan(worlds, q_start, q_goal, q_goal, keys)
    np.testing.assert_array_equal(broken.tree.parent, plain.tree.parent)
    np.testing.assert_array_equal(broken.expansions, plain.expansions)


def test_a_free_straight_motion_is_found_at_once():
    """RRT-Connect runs at the goal first: one expansion for each step of the way."""
    worlds, q_start, q_goal, keys = problems(16, seed=7)
    worlds = worlds._replace(radius=np.zeros_like(worlds.radius))
    result = small()(worlds, q_start, q_goal, q_goal, keys)
    steps = np.ceil(np.linalg.norm(q_goal - q_start, axis=-1) / 0.2)
    np.testing.assert_array_equal(result.expansions, steps)
    np.testing.assert_array_equal(result.path_length, steps + 1)
    assert np.all(result.status == Status.SOLVED)


@pytest.mark.parametrize("method", METHODS)
def test_statuses(method):
    """Each kind of bad question has its own answer and costs nothing; lanes are apart."""
    worlds, q_start, q_goal, keys = problems(16, seed=8)
    q_toggle = q_goal.copy()
    q_goal[0] = q_start[0]
    q_start[1] = worlds.centre[1, 0]
    q_goal[2] = worlds.centre[2, 0]
    q_start[3, 0], q_goal[4, 1] = Q_MAX + 0.01, -Q_MAX - 0.01
    q_start[5, 2], q_goal[6, 3], q_toggle[7, 4] = np.nan, np.inf, np.nan
    plan = small(method)
    result = jax.tree.map(np.asarray, plan(worlds, q_start, q_goal, q_toggle, keys))
    assert [Status(status) for status in result.status[:8]] == [
        Status.SOLVED,
        Status.START_IN_COLLISION,
        Status.GOAL_IN_COLLISION,
        Status.OUT_OF_LIMITS,
        Status.OUT_OF_LIMITS,
        Status.INVALID_INPUT,
        Status.INVALID_INPUT,
        Status.INVALID_INPUT,
    ]
    assert np.all(result.expansions[1:8] == 0)
    assert np.all(result.path_length[1:8] == 0)
    assert np.all(result.expansions[8:] > 0)
    assert np.all(result.path_length[8:] > 0)
    assert np.all(np.isfinite(result.path))
    np.testing.assert_array_equal(result.path[0, -1], q_goal[0])


@pytest.mark.parametrize("method", METHODS)
def test_budget_exhausted_returns_the_best_node(method):
    """A goal that a ball shuts in, in a corner of the box: the search ends at the budget."""
    worlds, q_start, q_goal, keys = problems(16, seed=9)
    q_goal[:] = Q_MAX
    worlds.centre[:, 0], worlds.radius[:, 0] = Q_MAX - 0.5, 0.5 * np.sqrt(7) - 0.01
    result = small(method)(worlds, q_start, q_goal, q_goal, keys)
    assert np.all(result.status == Status.BUDGET_EXHAUSTED)
    assert np.all(result.expansions == 60)
    assert np.all(result.path_length >= 1)
    assert np.all(result.learned == 0)


def test_compiles_once():
    """New worlds, problems, banks and padding run the program that is there."""
    traces = []

    def counted(worlds, problem, q0, q1):
        traces.append(None)
        return motion_free(worlds, problem, q0, q1)

    limit = np.full(7, Q_MAX)
    config = PlannerConfig(max_expansions=60, proposals=4)
    plan = make_planner(counted, config_free, config, -limit, limit)
    for seed in range(4):
        worlds, q_start, q_goal, keys = problems(6, seed=seed)
        draw = noisy_sampler(q_start, q_goal, keys, rows=2)
        active = np.arange(6) < 6 - seed
        plan(worlds, q_start, q_goal, q_goal, keys, draw, active)
        if seed == 0:
            first = len(traces)
    assert len(traces) == first


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "prm"}, "'prm'"),
        ({"proposals": 0}, "proposals 0"),
        ({"p_uniform": 1.5}, "p_uniform 1.5"),
        ({"goal_tolerance": float("nan")}, "goal_tolerance nan"),
        ({"step_min": 0.3}, "0.3, 0.2"),
        ({"metric": (1.0, 0.0)}, "7 positive"),
        ({"uniform_mode": "both"}, "'both'"),
    ],
)
def test_refuses_settings_that_make_no_sense(settings, message):
    with pytest.raises(ValueError, match=message):
        planner(PlannerConfig(**settings))


def test_refuses_arrays_of_the_wrong_shape():
    worlds, q_start, q_goal, keys = problems(3)
    plan = planner(PlannerConfig())
    with pytest.raises(ValueError, match=r"q_goal has shape \(3, 6\)"):
        plan(worlds, q_start, q_goal[:, :6], q_goal, keys)
    with pytest.raises(ValueError, match="lengths"):
        plan(worlds, q_start, q_goal[:2], q_goal, keys)

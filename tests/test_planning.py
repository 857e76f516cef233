"""The batched search against a sequential NumPy one, and the laws of a search tree."""

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
    noisy_sampler,
    points_free,
    problems,
)
from quick import jit

from jaxplan.config import PAPER_PLANNER
from jaxplan.planning import (
    PlanResult,
    Segment,
    Status,
    ends,
    lanes,
    make_planner,
)
from jaxplan.planning.edges import (
    STAGES,
    all_free,
    motions_free,
    place,
    places,
    points_for,
)
from jaxplan.planning.space import Space
from jaxplan.planning.state import Problem

METHODS = ("rrt", "rrt_connect")
LITERAL = replace(
    PAPER_PLANNER,
    method="rrt",
    goal_connect=0.0,
    goal_bias=0.0,
    uniform_mode="independent",
)


def settings_of(**changes):
    return replace(PAPER_PLANNER, **changes)


@cache
def planner(config, d=7, circular=()):
    """`circular`: indices of joints that come round, for whoever fears no obstacles there."""
    limit, round_ = np.full(d, Q_MAX), np.isin(np.arange(d), circular)
    return make_planner(config_free, config, -limit, limit, jit, round_)


@cache
def _grown(config, d):
    space = Space.of(np.full(d, -Q_MAX), np.full(d, Q_MAX), None, config.metric)
    go, rounds = jnp.array(False), jnp.int32(2**30)

    @jit
    def grow(worlds, state, problems, status, bank):
        def free(problem, q):
            return config_free(worlds, problem, q)

        return lanes.run(
            state, problems, status, bank, free, None, rounds, go, space, config
        )

    def begin(problems):
        problems, status = ends.examine(problems, space)
        empty = lanes.empty(problems, len(status), space, config)
        new = jnp.array(True)
        return (
            lanes.begin(empty, new, problems, status, space, config),
            problems,
            status,
        )

    return jit(begin), grow


def searched_trees(config, worlds, q_start, q_goal, q_toggle, keys, draw):
    """The answers, and the trees that led to them."""
    begin, grow = _grown(config, q_start.shape[1])
    ends = (jnp.asarray(q) for q in (q_start, q_goal, q_toggle))
    goals = jnp.zeros((len(keys), 0, q_start.shape[1]))
    problems = Problem(*ends, keys, jnp.full(len(keys), jnp.inf), goals)
    state, problems, status = begin(problems)
    waiting = np.ones(len(q_start), bool)
    while waiting.any():
        state = grow(worlds, state, problems, status, draw(state.state.bank_number))
        waiting = np.asarray(state.state.waiting)
    tree = state.state.tree._replace(q=jnp.swapaxes(state.state.tree.q, 1, 2))
    return jax.tree.map(np.asarray, (state.answers, tree))


def assert_same_answers(a, b):
    """The same to the last bit, whatever the batch."""
    for name in PlanResult._fields:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)


@pytest.mark.parametrize("points", [1, 2, 3, 8, 32, 33])
def test_stages_are_all_places_once_and_the_end_first(points):
    many = jnp.int32(points)
    groups = [
        [int(place(jnp.int32(s), jnp.int32(i), many)) for i in range(count)]
        for s in range(STAGES)
        if (count := int(places(jnp.int32(s), many)))
    ]
    assert groups[0] == [points]
    assert sorted(np.concatenate(groups)) == list(range(1, points + 1))


@pytest.mark.parametrize("rows", [4, 64])
def test_staged_checks_give_the_verdicts_of_all_checks(rows):
    worlds, q0, _, _ = problems(60, d=3, seed=11)
    rng = np.random.default_rng(0)
    q1 = (q0 + rng.normal(size=q0.shape) * 0.4).astype(np.float32)
    problem, asked = rng.integers(0, 60, 60), rng.random(60) < 0.8

    on_device = jax.tree.map(jnp.asarray, worlds)

    def free(problem, q):
        return config_free(on_device, problem, q)

    def check(q0, q1):
        return motions_free(
            free, jnp.asarray(problem), q0, q1, jnp.asarray(10 * asked), rows
        )

    verdicts, checks = (np.asarray(x) for x in jit(check)(q0, q1))
    expected = asked & points_free(worlds, problem, q0, q1, 10)
    np.testing.assert_array_equal(verdicts, expected)
    assert 10 < expected.sum() < asked.sum() - 5
    assert np.all(checks[verdicts] == 10)
    assert np.all(checks[asked & ~verdicts] <= 10)
    assert np.all(checks[~asked] == 0)

    counts = rng.integers(0, 20, 60).astype(np.int32)
    dense = jit(
        lambda q0, q1: all_free(
            free, jnp.asarray(problem), q0, q1, jnp.asarray(counts), rows
        )
    )
    each = [
        count == 0 or points_free(worlds, problem[[i]], q0[[i]], q1[[i]], count).all()
        for i, count in enumerate(counts)
    ]
    np.testing.assert_array_equal(dense(q0, q1), each)


@pytest.mark.parametrize("method", METHODS)
def test_any_number_of_lanes_gives_the_same_answers(method):
    """100 problems that queue for 3 lanes, or for 32, or have one each."""
    worlds, q_start, q_goal, keys = problems(100, seed=1)
    args = (worlds, q_start, q_goal, q_goal, keys)
    config = settings_of(method=method, max_expansions=120, workers=4)
    few, some, all_ = (planner(replace(config, lanes=n))(*args) for n in (3, 32, 100))
    assert_same_answers(few, some)
    assert_same_answers(some, all_)
    assert 0 < np.sum(few.status == Status.SOLVED) < 100


def test_workers_need_fewer_rounds():
    worlds, q_start, q_goal, keys = problems(50, seed=10)
    args = (worlds, q_start, q_goal, q_goal, keys)
    config = settings_of(max_expansions=2000)
    one, many = (planner(replace(config, workers=k))(*args) for k in (1, 8))
    assert np.all(one.status == Status.SOLVED)
    assert np.all(many.status == Status.SOLVED)
    assert np.median(many.expansions) / 8 < np.median(one.expansions)


@pytest.mark.parametrize("method", METHODS)
def test_paths_are_checked_densely(method):
    """With edges checked at their ends only, every path that is returned is sound all the same."""
    worlds, q_start, q_goal, keys = problems(50, d=3, spheres=30, seed=12)
    config = settings_of(
        method=method, max_expansions=3000, edge_resolution=0.2, workers=4
    )
    args = (worlds, q_start, q_goal, q_goal, keys)
    loose = planner(config, d=3)(*args)
    strict = planner(replace(config, path_resolution=0.01), d=3)(*args)

    def unsound(result):
        count = 0
        for p in np.flatnonzero(result.status == Status.SOLVED):
            path = np.asarray(result.path[p, : result.path_length[p]])
            shrunk = worlds._replace(radius=worlds.radius - 1e-5)
            problem = np.full(len(path) - 1, p)
            count += not points_free(shrunk, problem, path[:-1], path[1:], 20).all()
        return count

    assert unsound(loose) > 0
    assert unsound(strict) == 0
    assert np.sum(strict.status == Status.SOLVED) > 40


@pytest.mark.parametrize("workers", [1, 4])
def test_paths_lead_from_the_start_to_the_goal(workers):
    """Whichever tree came to the other, and however small that was."""
    worlds, q_start, q_goal, keys = problems(32, d=3, seed=13)
    config = settings_of(
        balance=True,
        workers=workers,
        step_min=0.4,
        step_max=0.4,
        max_expansions=2000,
    )
    result = planner(config, d=3)(worlds, q_start, q_goal, q_goal, keys)
    solved = result.status == Status.SOLVED
    assert solved.sum() > 24
    start, goal = np.moveaxis(np.asarray(result.path)[solved][:, [0, -1]], 1, 0)
    np.testing.assert_array_equal(start, q_start[solved])
    np.testing.assert_array_equal(goal, q_goal[solved])


def test_ao_rrt_connect_tends_to_the_shortest_path():
    """Around one ball the shortest path is known: two tangents and an arc."""
    count, radius, reach = 16, 0.5, 1.0
    worlds = Spheres(
        np.zeros((count, 1, 3), np.float32), np.full((count, 1), radius, np.float32)
    )
    q_start = np.tile(np.float32([-reach, 0, 0]), (count, 1))
    keys = jax.vmap(jax.random.key)(jnp.arange(count))
    tangent = np.sqrt(reach**2 - radius**2)
    arc = np.pi - 2 * np.arccos(radius / reach)
    shortest = 2 * tangent + radius * arc

    def lengths(budget):
        config = settings_of(
            method="ao_rrt_connect",
            max_expansions=budget,
            path_resolution=0.01,
            workers=4,
        )
        result = planner(config, d=3)(worlds, q_start, -q_start, q_start, keys)
        assert np.all(result.status == Status.SOLVED)
        paths = [
            np.asarray(path[:length])
            for path, length in zip(result.path, result.path_length, strict=True)
        ]
        for path in paths:
            np.testing.assert_array_equal(path[[0, -1]], [q_start[0], -q_start[0]])
        steps = (np.linalg.norm(np.diff(path, axis=0), axis=1) for path in paths)
        return np.array([step.sum() for step in steps])

    early, late = lengths(400), lengths(12_000)
    assert np.all(late <= early)
    assert np.all(late > 0.99 * shortest)
    assert np.median(late) < 1.05 * shortest
    assert np.median(late - shortest) < 0.5 * np.median(early - shortest)


def test_ao_rrt_connect_stops_at_a_straight_path():
    worlds, q_start, q_goal, keys = problems(16, seed=7)
    worlds = worlds._replace(radius=np.zeros_like(worlds.radius))
    config = settings_of(method="ao_rrt_connect", max_expansions=400)
    result = planner(config)(worlds, q_start, q_goal, q_goal, keys)
    assert np.all(result.status == Status.SOLVED)
    assert np.all(result.expansions < 50)


ORACLE_CONFIGS = {
    "rrt": settings_of(method="rrt"),
    "rrt, literal": LITERAL,
    "rrt, other settings": settings_of(
        method="rrt",
        metric=(1, 1, 0.9, 0.9, 0.6, 0.5, 0.3),
        toggle_tie_break=0.1,
        goal_tolerance=0.2,
    ),
    "rrt_connect": settings_of(),
    "rrt_connect, other settings": settings_of(
        uniform_mode="independent",
        goal_tree="uniform",
        toggle_tie_break=0.2,
        p_uniform=0.6,
    ),
    "rrt, with bases": settings_of(method="rrt"),
    "rrt_connect, with bases": settings_of(),
    "rrt_connect, with bases, other settings": settings_of(
        goal_tree="uniform", toggle_tie_break=0.2
    ),
    "rrt, greedy": settings_of(method="rrt", greedy=True),
    "rrt_connect, with bases, greedy": settings_of(greedy=True, p_uniform=0.5),
}


@pytest.mark.parametrize("name", ORACLE_CONFIGS)
def test_batched_search_is_the_sequential_one(name):
    """A plain NumPy planner, fed the same random numbers, grows the same trees."""
    config = replace(ORACLE_CONFIGS[name], max_expansions=100)
    count = 24
    worlds, q_start, q_goal, keys = problems(count, seed=2)
    q_toggle = q_goal + 0.3
    draw = noisy_sampler(q_start, q_goal, keys, based="with bases" in name)
    result, tree = searched_trees(config, worlds, q_start, q_goal, q_toggle, keys, draw)
    banks = [draw(jnp.full(count, c)) for c in range(100 // 8 + 1)]
    for p in range(count):
        segments = jax.tree.map(
            lambda *c, p=p: jnp.concatenate([x[p] for x in c]), *banks
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
        assert result.accepted[p] == sum(oracle.flags)
        assert tree.size[p] == size
        np.testing.assert_array_equal(tree.parent[p, :size], oracle.parent)
        np.testing.assert_array_equal(tree.side[p, :size], oracle.side)
        np.testing.assert_allclose(tree.q[p, :size], oracle.q, atol=1e-5)


@pytest.fixture(scope="module", params=METHODS)
def searched(request):
    """A search in the plane, with many obstacles."""
    return settings_of(method=request.param, max_expansions=200, workers=8)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=8)
def test_every_result_is_a_tree_and_a_free_path(searched, seed):
    """Parents precede children, edges are free and short, the path runs start to end."""
    config = searched
    worlds, q_start, q_goal, keys = problems(32, d=2, spheres=6, seed=seed)
    draw = noisy_sampler(q_start, q_goal, keys)
    result, tree = searched_trees(config, worlds, q_start, q_goal, q_goal, keys, draw)
    assert np.all(np.isfinite(tree.q))
    assert np.all(np.abs(tree.q) <= Q_MAX)
    assert np.all(result.expansions <= config.max_expansions)
    for p in range(32):
        size = tree.size[p]
        q, parent = tree.q[p, :size], tree.parent[p, :size]
        assert np.all(parent < np.arange(size))
        edges = np.flatnonzero(parent >= 0)
        assert len(edges) == result.accepted[p]
        assert_free(worlds, p, q[parent[edges]], q[edges], config)
        if result.status[p] > Status.BUDGET_EXHAUSTED:
            assert result.path_length[p] == 0
            continue
        length = result.path_length[p]
        path, rest = np.split(result.path[p], [length])
        assert_free(worlds, p, path[:-1], path[1:], config)
        np.testing.assert_array_equal(path[0], q_start[p])
        assert np.all(rest == path[-1])
        gap = np.linalg.norm(path[-1] - q_goal[p])
        if result.status[p] == Status.BUDGET_EXHAUSTED:
            nodes = q[tree.side[p, :size] == 0]
            reached = np.linalg.norm(nodes - q_goal[p], axis=-1)
            assert gap == pytest.approx(reached.min())
        elif config.method == "rrt_connect":
            np.testing.assert_array_equal(path[-1], q_goal[p])
        else:
            assert gap <= config.goal_tolerance


def assert_free(worlds, problem, q0, q1, config):
    """Motions of a problem are free where a planner looks, and no longer than a step."""
    # room for the rounding of a verdict that was computed by another program
    worlds = worlds._replace(radius=worlds.radius - 1e-5)
    lengths = np.linalg.norm(np.float32(q1) - np.float32(q0), axis=-1)
    points = np.array([points_for(x, config.edge_resolution) for x in lengths])
    for count in np.unique(points):
        same = points == count
        # both ways: edges of the goal's tree were checked from their other end
        there, back = (
            points_free(worlds, np.full(same.sum(), problem), *ends, count)
            for ends in ((q0[same], q1[same]), (q1[same], q0[same]))
        )
        assert np.all(there | back)
    assert np.all(np.linalg.norm(q1 - q0, axis=-1) <= config.step_max * 1.001)


@pytest.mark.parametrize("workers", [2, 16])
@pytest.mark.parametrize("circular", [(), (0, 3, 6)])
@pytest.mark.parametrize("method", METHODS)
def test_results_do_not_depend_on_the_batch(method, circular, workers):
    """A problem has the same answer alone, in company, elsewhere in it, and padded."""
    worlds, q_start, q_goal, keys = problems(12, seed=3)
    settings = settings_of(method=method, max_expansions=60, workers=workers)
    plan = planner(settings, circular=circular)

    def run(lanes, active=None):
        lanes = np.asarray(lanes)
        part = jax.tree.map(lambda x: x[lanes], (worlds, q_start, q_goal, keys))
        draw = noisy_sampler(part[1], part[2], part[3], 16)
        return plan(part[0], part[1], part[2], part[2], part[3], draw, active)

    def lanes_of(result, lanes):
        return jax.tree.map(lambda x: np.asarray(x)[np.asarray(lanes)], result)

    whole = run(range(12))
    assert_same_answers(lanes_of(whole, [5]), run([5]))
    order = np.random.default_rng(0).permutation(12)
    assert_same_answers(lanes_of(whole, order), run(order))
    active = np.arange(12) < 4
    padded = run(range(12), active)
    assert_same_answers(lanes_of(whole, range(4)), lanes_of(padded, range(4)))
    assert np.all(padded.status[4:] == Status.INACTIVE)
    assert np.all(padded.expansions[4:] == 0)
    assert np.all(padded.path_length[4:] == 0)


def small(method: Literal["rrt", "rrt_connect"] = "rrt_connect"):
    """One planner for the tests that need nothing special."""
    return planner(settings_of(method=method, max_expansions=60))


def test_p_uniform_1_is_plain_rrt():
    """With p_uniform = 1 the sampler is never asked, and the tree is that of no sampler."""
    worlds, q_start, q_goal, keys = problems(16, seed=4)

    def never(bank_number):
        raise AssertionError("asked")

    plan = planner(settings_of(max_expansions=60, p_uniform=1.0))
    uniform = plan(worlds, q_start, q_goal, q_goal, keys, never)
    assert_same_answers(uniform, small()(worlds, q_start, q_goal, q_goal, keys))
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
    plan = planner(settings_of(max_expansions=2000, workers=8))
    result = plan(worlds, q_start, q_goal, q_goal, keys, lambda bank_number: bank)
    assert np.all(result.status == Status.SOLVED), np.bincount(result.status)
    assert np.all(np.isfinite(result.path))


def test_a_broken_sampler_leaves_plain_rrt():
    """Segments that are no move give way to the uniform proposal of their expansion."""
    worlds, q_start, q_goal, keys = problems(16, seed=6)
    bank = Segment(jnp.full((16, 8, 7), jnp.nan), jnp.ones((16, 8)))
    plan = small()
    broken = plan(worlds, q_start, q_goal, q_goal, keys, lambda bank_number: bank)
    plain = plan(worlds, q_start, q_goal, q_goal, keys)
    np.testing.assert_array_equal(broken.path, plain.path)
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

    def counted(worlds, problem, q):
        traces.append(None)
        return config_free(worlds, problem, q)

    limit = np.full(7, Q_MAX)
    config = settings_of(max_expansions=60)
    plan = make_planner(counted, config, -limit, limit, jit)
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
        ({"workers": 0}, "workers 0"),
        ({"p_uniform": 1.5}, "p_uniform 1.5"),
        ({"goal_tolerance": float("nan")}, "goal_tolerance nan"),
        ({"step_min": 0.3}, "0.3, 0.2"),
        ({"metric": (1.0, 0.0)}, "more than 0"),
        ({"metric": (1.0, 2.0)}, "7 weights"),
        ({"uniform_mode": "both"}, "'both'"),
    ],
)
def test_refuses_settings_that_make_no_sense(settings, message):
    with pytest.raises(ValueError, match=message):
        planner(settings_of(**settings))


def test_refuses_arrays_of_the_wrong_shape():
    worlds, q_start, q_goal, keys = problems(3)
    plan = planner(PAPER_PLANNER)
    with pytest.raises(ValueError, match=r"q_goal has shape \(3, 6\)"):
        plan(worlds, q_start, q_goal[:, :6], q_goal, keys)
    with pytest.raises(ValueError, match="lengths"):
        plan(worlds, q_start, q_goal[:2], q_goal, keys)


def test_the_sampler_is_asked_when_a_search_asks():
    """Where straight motions are free, no segment is drawn; answers do not change."""
    worlds, q_start, q_goal, keys = problems(6, seed=3)
    config = settings_of(method="rrt_connect", max_expansions=60)
    limit = np.full(7, Q_MAX)
    plan = make_planner(config_free, config, -limit, limit, jit)
    draw, asked = noisy_sampler(q_start, q_goal, keys), []

    def listened(bank_number):
        asked.append(np.asarray(bank_number))
        return draw(bank_number)

    first = plan(worlds, q_start, q_goal, q_goal, keys, listened)
    asked.clear()
    again = plan(worlds, q_start, q_goal, q_goal, keys, listened)
    assert_same_answers(first, again)
    assert any(np.any(bank_number >= 0) for bank_number in asked)
    for bank_number in asked:
        assert np.all(np.asarray(first.learned)[bank_number >= 0] > 0)
    asked.clear()
    plan(worlds, q_start, q_start, q_start, keys, listened)
    assert asked == []

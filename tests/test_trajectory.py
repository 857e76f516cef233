"""Trajectories: the laws they keep, closed forms, and the fallback."""

import jax
import numpy as np
import pytest
import toppra
from hypothesis import given, settings
from hypothesis import strategies as st
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from jaxplan.config import TrajectoryConfig
from jaxplan.robots import PANDA
from jaxplan.trajectory import (
    Rung,
    Validation,
    evaluate,
    fit_polyline,
    fit_spline,
    make_trajectory,
    shortcut,
    time_parameterize,
)
from jaxplan.trajectory.spline import arc_length, bezier

toppra.setup_logging("ERROR")

CONFIG = TrajectoryConfig()
VELOCITY = CONFIG.velocity_scale * PANDA.limits.velocity
ACCELERATION = CONFIG.acceleration_scale * PANDA.limits.acceleration


def everywhere(problem, q):
    """No obstacle."""
    assert q.shape[0] == problem.shape[0] == CONFIG.check_rows
    return np.ones(len(q), bool)


def outside_ball(radius):
    """A ball around the origin of the first two joints."""

    def config_free(problem, q):
        assert q.shape[0] == problem.shape[0] == CONFIG.check_rows
        return np.linalg.norm(q[:, :2], axis=1) > radius

    return config_free


def zigzag(seed, waypoints=8, d=7, step=0.3):
    """A random walk inside the Panda's limits `[waypoints, d]`."""
    moves = np.random.default_rng(seed).normal(size=(waypoints - 1, d))
    moves *= step / np.linalg.norm(moves, axis=1, keepdims=True)
    middle = (PANDA.limits.q_min + PANDA.limits.q_max)[:d] / 2
    return middle + np.concatenate([np.zeros((1, d)), np.cumsum(moves, axis=0)])


def around(radius, corners=9):
    """A polyline in 2-D from (-1, 0) over the ball to (1, 0)."""
    angle = np.linspace(np.pi, 0, corners)
    arc = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([[[-1.0, 0.0]], arc, [[1.0, 0.0]]])


def make(paths, config_free=everywhere, config=CONFIG, seeds=None, d=7, **more):
    """`make_trajectory` of a list of unpadded paths under the Panda's limits."""
    length = np.array([len(path) for path in paths])
    padded = np.stack(
        [np.pad(p, ((0, length.max() - len(p)), (0, 0)), "edge") for p in paths]
    )
    seeds = np.arange(len(paths)) if seeds is None else np.array(seeds)
    return make_trajectory(
        padded,
        length,
        jax.vmap(jax.random.key)(seeds),
        config_free,
        PANDA.limits.velocity[:d],
        PANDA.limits.acceleration[:d],
        config,
        **more,
    )


NO_SHORTCUT = TrajectoryConfig(shortcut_rounds=0)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), waypoints=st.integers(2, 9))
def test_limits_hold_and_ends_are_exact(seed, waypoints):
    path = zigzag(seed, waypoints)
    done = make([path], config=NO_SHORTCUT)
    n = done.length[0]
    np.testing.assert_allclose(done.q[0, 0], path[0], atol=1e-12)
    np.testing.assert_allclose(done.q[0, n - 1], path[-1], atol=1e-12)
    assert not done.qd[0, [0, n - 1]].any()
    assert (np.abs(done.qd) <= VELOCITY * 1.001).all()
    assert (np.abs(done.qdd) <= ACCELERATION * 1.01).all()
    low, high = path.min(axis=0), path.max(axis=0)
    assert (done.q >= low - 1e-9).all()
    assert (done.q <= high + 1e-9).all()


def test_derivatives_are_those_of_the_samples():
    config = TrajectoryConfig(shortcut_rounds=0, control_period=0.001)
    done = make([zigzag(3)], config=config)
    qd = np.gradient(done.q[0], done.times, axis=0)
    np.testing.assert_allclose(done.qd[0, 1:-1], qd[1:-1], atol=0.01)
    moved = np.cumsum(done.qdd[0] * 0.001, axis=0)[:-1]
    np.testing.assert_allclose(done.qd[0, 1:], moved, atol=0.03)


@pytest.mark.parametrize("distance", [0.05, 0.4, 2.0])
def test_a_straight_line_takes_the_bang_bang_time(distance):
    v, a = VELOCITY[0], ACCELERATION[0]
    whole = distance / v + v / a if distance > v**2 / a else 2 * np.sqrt(distance / a)
    curve = fit_polyline(np.array([[0.0], [distance]]))
    timing = time_parameterize([curve], VELOCITY[:1], ACCELERATION[:1])
    assert timing.times[0, -1] == pytest.approx(whole, rel=0.02)
    assert timing.times[0, -1] >= whole * (1 - 1e-9)


def test_a_spline_along_a_straight_line_is_the_line():
    path = zigzag(0, 2)
    curve = fit_spline(path, 0.1)
    s = np.linspace(0, curve.t[-1], 50)
    np.testing.assert_allclose(curve(s), fit_polyline(path)(s), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(curve(s, 1), axis=1), 1.0)


def test_timing_is_nearly_the_best_of_a_fine_grid():
    """A circle at constant speed: joint accelerations are v^2/r, so v is sqrt(a r)."""
    angle = np.linspace(0, 20 * np.pi, 4000)
    circle = 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    curve = fit_spline(circle, 0.01)
    timing = time_parameterize([curve], np.full(2, 10.0), np.full(2, 1.0))
    middle = timing.speed[0, len(timing.s[0]) // 4 : -len(timing.s[0]) // 4]
    assert middle.mean() >= 0.95 * np.sqrt(0.1)
    assert middle.max() <= 1.2 * np.sqrt(0.1)  # |(cos, sin)| leaves room in between


class Known:
    """One of our curves, as toppra takes them."""

    def __init__(self, curve):
        self.curve, self.dof = curve, curve.c.shape[1]
        self.path_interval = np.array([0.0, curve.t[-1]])
        self.waypoints = None

    def __call__(self, s, order=0):
        return self.curve(np.clip(s, 0.0, self.curve.t[-1]), order)


def toppra_duration(curve, velocity, acceleration, intervals=1000):
    """Of the fastest motion on a fine grid, its limits kept between grid points too."""
    grid = np.linspace(0.0, curve.t[-1], intervals + 1)
    grid = np.unique(np.concatenate([grid, curve.t]))
    limits = [
        JointVelocityConstraint(np.stack([-velocity, velocity], 1)),
        JointAccelerationConstraint(np.stack([-acceleration, acceleration], 1)),
    ]
    for limit in limits:
        limit.set_discretization_type(1)
    solver = TOPPRA(limits, Known(curve), grid, solver_wrapper="seidel")
    _, speed, _ = solver.compute_parameterization(0.0, 0.0)
    return np.sum(2.0 * np.diff(grid) / (speed[1:] + speed[:-1]))


@pytest.mark.parametrize("spline_step", [0.025, 0.1, 0.3])
@pytest.mark.parametrize("step", [0.15, 0.8])
def test_random_splines_take_the_time_of_toppra(spline_step, step):
    curves = [fit_spline(zigzag(seed, 7, step=step), spline_step) for seed in range(6)]
    best = np.array([toppra_duration(c, VELOCITY, ACCELERATION) for c in curves])
    timing = time_parameterize(curves, VELOCITY, ACCELERATION)
    took = timing.times[:, -1] / best
    assert took.min() >= 0.99
    assert took.max() <= 1.04
    assert took.mean() <= 1.02


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    degree=st.sampled_from([1, 3]),
    spline_step=st.floats(0.02, 0.5),
)
def test_limits_hold_between_all_grid_points(seed, degree, spline_step):
    path = zigzag(seed, 5, step=0.4)
    curve = fit_polyline(path) if degree == 1 else fit_spline(path, spline_step)
    timing = time_parameterize([curve], VELOCITY, ACCELERATION)
    s, speed, times = (row[0] for row in timing)
    t = np.linspace(0.0, times[-1], 20_000)
    _, qd, qdd = evaluate(curve, s, speed, times, t)
    assert (np.abs(qd) <= VELOCITY * (1 + 1e-5)).all()
    assert (np.abs(qdd) <= ACCELERATION * (1 + 1e-5)).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_shortcuts_are_free_and_never_longer(seed):
    path = around(0.5)
    validation = Validation(outside_ball(0.4), None, CONFIG.check_rows, 0.01)
    noise = np.random.default_rng(seed).uniform(0, 0.2, path[1:-1].shape)
    path[1:-1] *= 1 + noise
    (short,) = shortcut(
        [path], jax.vmap(jax.random.key)(np.array([seed])), validation, CONFIG
    )
    assert arc_length(short)[-1] < arc_length(path)[-1]
    np.testing.assert_array_equal(short[[0, -1]], path[[0, -1]])
    curve = fit_polyline(short)
    dense = curve(np.linspace(0, curve.t[-1], 2000))
    assert (np.linalg.norm(dense, axis=1) > 0.4 - 1e-3).all()


def wraps(path, circular):
    """`path` as a planner on circles has it: no circular joint moves by pi or more."""
    step = np.diff(path, axis=0)
    step -= circular * 2 * np.pi * np.round(step / (2 * np.pi))
    return path[0] + np.concatenate([np.zeros((1, len(circular))), np.cumsum(step, 0)])


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    circular=st.lists(st.booleans(), min_size=3, max_size=3),
    blocked=st.booleans(),
)
def test_shortcuts_go_the_short_way_round_a_circle(seed, circular, blocked):
    circular = np.array(circular)
    rng = np.random.default_rng(seed)
    path = wraps(rng.uniform(-4, 4, (7, 3)), circular)
    validation = Validation(
        # Of a circular joint only the angle counts.
        lambda problem, q: (np.cos(q[:, 0] - path[3, 0]) < 0.9) | ~np.bool_(blocked),
        None,
        CONFIG.check_rows,
        0.01,
    )
    keys = jax.vmap(jax.random.key)(np.array([seed]))
    (short,) = shortcut([path], keys, validation, CONFIG, circular)
    assert arc_length(short)[-1] <= arc_length(path)[-1] + 1e-9
    np.testing.assert_array_equal(short[0], path[0])
    turns = (short[-1] - path[-1]) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    assert not turns[~circular].any()
    (plain,) = shortcut([path], keys, validation, CONFIG)
    if not circular.any():
        np.testing.assert_array_equal(short, plain)
    if not blocked:
        apart = path[-1] - path[0]
        apart -= circular * 2 * np.pi * np.round(apart / (2 * np.pi))
        assert arc_length(short)[-1] == pytest.approx(np.linalg.norm(apart))
        np.testing.assert_array_equal(plain[-1], path[-1])


def test_a_motion_round_a_circle_ends_at_full_turns_from_its_goal():
    angle = np.linspace(0.0, 6.0, 7)  # the long way from 0 to 6 rad
    path = np.stack([angle, np.sin(angle)], axis=1)
    done = make([path], d=2, circular=np.array([True, False]))
    ends = done.q[0, [0, done.length[0] - 1]]
    expected = [path[0], path[-1] - [2 * np.pi, 0.0]]
    np.testing.assert_allclose(ends, expected, atol=1e-12)
    assert arc_length(done.q[0])[-1] < 0.5
    along_the_joint = make([path], d=2)
    assert arc_length(along_the_joint.q[0])[-1] > 6.0


def test_bezier_pieces_are_the_curve():
    for curve in (fit_spline(zigzag(1), 0.1), fit_polyline(zigzag(1))):
        pieces, breaks = bezier(curve), np.unique(curve.t)
        t = np.linspace(0, 1, 5)
        weights = np.stack(
            [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], 1
        )
        s = breaks[:-1, None] + t * np.diff(breaks)[:, None]
        np.testing.assert_allclose(weights @ pieces, curve(s), atol=1e-12)


def ball(radius, rows=CONFIG.check_rows):
    """Proofs around a ball at the origin, in any dimension."""

    def swept_free(problem, q, motion):
        assert len(problem) == len(q) == len(motion) == rows
        gap = np.linalg.norm(q, axis=1) - radius
        return gap > np.linalg.norm(motion, axis=1)

    return swept_free


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    degree=st.sampled_from([1, 3]),
    gap=st.sampled_from([0.3, 1e-2, 1e-4, 1e-6]),
    rows=st.sampled_from([16, 1024]),
)
def test_a_curve_is_free_exactly_when_nothing_on_it_collides(seed, degree, gap, rows):
    rng = np.random.default_rng(seed)
    paths = rng.normal(size=(3, 6, 3))
    curves = [fit_polyline(p) if degree == 1 else fit_spline(p, 0.3) for p in paths]
    # The middle one grazes the ball; the verdict on it depends on the gap alone.
    near = [np.linalg.norm(c(np.linspace(0, c.t[-1], 10**5)), axis=1) for c in curves]
    radius = near[1].min()
    for sign in (1, -1):
        size = radius - sign * max(gap, 1e-6)
        if size <= 0:
            continue
        validation = Validation(everywhere, ball(size, rows), rows, 0.01)
        free = validation.curves_free([0, 1, 2], curves)
        assert free[1] == (sign > 0)
        for verdict, distances in zip(free, near, strict=True):
            if abs(distances.min() - size) > 1e-7:
                assert verdict == (distances.min() > size)


def walled(thickness):
    """A wall of that thickness across the first joint, open where the second is > 1."""

    def config_free(problem, q):
        return (np.abs(q[:, 0]) > thickness / 2) | (q[:, 1] > 1)

    def swept_free(problem, q, motion):
        beside = np.abs(q[:, 0]) - motion[:, 0] > thickness / 2
        return beside | (q[:, 1] - motion[:, 1] > 1)

    return config_free, swept_free


def over_the_wall(seed):
    """A winding path in 2-D from one side to the other."""
    rng = np.random.default_rng(seed)
    left = np.stack([np.linspace(-1, -0.2, 4), rng.uniform(-1, 1, 4)], 1)
    right = np.stack([np.linspace(0.2, 1, 4), rng.uniform(-1, 1, 4)], 1)
    return np.concatenate([left, [[-0.1, 1.2], [0.1, 1.2]], right])


@pytest.mark.parametrize("thickness", [1e-3, 3e-4])
def test_no_motion_goes_through_a_thin_wall(thickness):
    config_free, swept_free = walled(thickness)
    paths = [over_the_wall(seed) for seed in range(40)]
    done = make(paths, config_free, d=2, swept_free=swept_free)
    assert (done.rung < Rung.INVALID).all()
    assert len(set(done.rung)) > 1
    for q in done.q:
        crossing = np.flatnonzero(np.diff(np.sign(q[:, 0])))
        assert (q[crossing, 1] > 1 - 0.02).all()


def test_the_path_that_was_found_is_the_last_resort():
    """Points leave gaps; a search has looked at its own path more closely."""
    config_free, _ = walled(2e-3)
    paths = [over_the_wall(seed) for seed in range(40)]
    done = make(paths, config_free, d=2)
    assert (done.rung < Rung.INVALID).all()
    assert (done.rung == Rung.PATH).any()
    for p in np.flatnonzero(done.rung == Rung.PATH):
        along = fit_polyline(paths[p])
        close = along(np.linspace(0, along.t[-1], 4000))
        gaps = np.linalg.norm(done.q[p][:, None] - close, axis=-1).min(axis=1)
        assert gaps.max() < 2e-3


def test_a_free_detour_becomes_one_line():
    done = make([zigzag(1)])
    assert done.rung[0] == Rung.LINE
    n = done.length[0]
    ends = zigzag(1)[[0, -1]]
    assert arc_length(done.q[0, :n])[-1] == pytest.approx(arc_length(ends)[-1])


def test_a_spline_that_cuts_a_corner_gives_way():
    corner = np.array([[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])

    def reached(room):
        def config_free(problem, q):
            return np.minimum(-q[:, 0], q[:, 1]) <= room

        config = TrajectoryConfig(shortcut_rounds=0, spline_step=0.2)
        return make([corner], config_free, config, d=2)

    assert reached(0.2).rung[0] == Rung.SPLINE
    assert reached(0.02).rung[0] == Rung.DENSER
    at_rest = reached(0.0)
    assert at_rest.rung[0] == Rung.POLYLINE
    nearest = np.linalg.norm(at_rest.q[0], axis=1).argmin()
    assert np.linalg.norm(at_rest.q[0, nearest]) < 1e-3
    assert np.linalg.norm(at_rest.qd[0, nearest]) < 0.05
    assert (np.minimum(-at_rest.q[0, :, 0], at_rest.q[0, :, 1]) <= 1e-9).all()
    assert reached(-1.0).rung[0] == Rung.INVALID


def test_what_was_validated_is_what_moves():
    done = make([around(0.5)], outside_ball(0.45), d=2)
    assert done.rung[0] in (Rung.SPLINE, Rung.DENSER, Rung.POLYLINE)
    assert (np.linalg.norm(done.q[0], axis=1) > 0.45 - 1e-3).all()


def test_neighbours_change_nothing():
    paths = [zigzag(5, 6), zigzag(6, 2), zigzag(7, 9)]
    obstacle = zigzag(7, 9)[4]

    def config_free(problem, q):
        return np.linalg.norm(q - obstacle - 0.05, axis=1) > 0.1

    together = make(paths, config_free, seeds=[1, 2, 3])
    for p, (path, seed) in enumerate(zip(paths, [1, 2, 3], strict=True)):
        alone = make([path], config_free, seeds=[seed])
        n = alone.length[0]
        assert together.length[p] == n
        assert together.rung[p] == alone.rung[0]
        for both, one in zip(together[1:4], alone[1:4], strict=True):
            np.testing.assert_array_equal(both[p, :n], one[0, :n])
        assert (together.q[p, n:] == path[-1]).all()


def test_checks_are_asked_of_the_right_problem():
    paths = [around(0.5), around(0.5)]

    def config_free(problem, q):
        return (problem == 0) | (np.linalg.norm(q, axis=1) > 0.45)

    done = make(paths, config_free, d=2)
    assert done.rung[0] == Rung.LINE
    assert done.rung[1] > Rung.LINE


def test_staying_is_a_trajectory():
    stay = zigzag(2)[:1]
    for path in (stay, np.repeat(stay, 3, axis=0)):
        done = make([path])
        np.testing.assert_allclose(done.q[0], np.repeat(stay, len(done.q[0]), 0))
        assert not done.qd.any()
        assert done.length[0] <= 2

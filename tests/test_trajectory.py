"""Trajectories: the laws they keep, closed forms, and the fallback."""

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxplan.config import TrajectoryConfig
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.trajectory import (
    Rung,
    Validation,
    fit_polyline,
    fit_spline,
    make_trajectory,
    shortcut,
    time_parameterize,
)
from jaxplan.trajectory.spline import arc_length

CONFIG = TrajectoryConfig()
VELOCITY = CONFIG.velocity_scale * PANDA_LIMITS.velocity
ACCELERATION = CONFIG.acceleration_scale * PANDA_LIMITS.acceleration


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
    middle = (PANDA_LIMITS.q_min + PANDA_LIMITS.q_max)[:d] / 2
    return middle + np.concatenate([np.zeros((1, d)), np.cumsum(moves, axis=0)])


def around(radius, corners=9):
    """A polyline in 2-D from (-1, 0) over the ball to (1, 0)."""
    angle = np.linspace(np.pi, 0, corners)
    arc = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([[[-1.0, 0.0]], arc, [[1.0, 0.0]]])


def make(paths, config_free=everywhere, config=CONFIG, seeds=None, d=7):
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
        PANDA_LIMITS.velocity[:d],
        PANDA_LIMITS.acceleration[:d],
        config,
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

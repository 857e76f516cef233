"""What varies in pictures: drawn from the seed, seen by the camera alone, within its bounds."""

import mujoco
import numpy as np
import pytest

from jaxplan import tasks
from jaxplan.tasks.perturbation import NOMINAL, Perturbation, draw, turned, with_noise

KINDS = {
    "camera": Perturbation(yaw=10, pitch=10, translation=0.02),
    "noise": Perturbation(noise=0.05),
    "light": Perturbation(light=1.0),
    "colours": Perturbation(colours=1.0),
    "distractor": Perturbation(distractor=True),
}


@pytest.fixture(scope="module")
def task():
    return tasks.load("mug", 3)


def pictures(task, perturbation, seeds=(4, 5, 6)) -> np.ndarray:
    task.eyes.perturbation = perturbation
    task.reset(range(3), seeds)
    return task.observe(range(3)).images["hand"]


def test_nothing_is_the_picture_as_it_is(task, mug_task):
    plain = pictures(task, NOMINAL)
    mug_task.reset(range(3), (4, 5, 6))
    np.testing.assert_array_equal(plain, mug_task.observe(range(3)).images["hand"][:3])
    assert task.eyes.drawn == [None] * 3
    np.testing.assert_array_equal(pictures(task, Perturbation(each_query=True)), plain)


@pytest.mark.parametrize("variant", ["plain", "cluttered"])
def test_next_to_nothing_is_the_picture_as_it_is(variant):
    """What waits out of sight changes neither the near plane nor the shadows."""
    task, seeds = tasks.load("mug", 3, variant), (4, 5, 6)
    task.reset(range(3), seeds)
    for data in task.sim.data:
        mujoco.mj_forward(task.model, data)  # poses are of a step before
    plain = task.observe(range(3)).images["hand"]
    for name in ("yaw", "pitch", "translation", "light"):
        task.eyes.perturbation = Perturbation(**{name: 1e-12})
        np.testing.assert_array_equal(task.observe(range(3)).images["hand"], plain)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_changes_pictures_and_nothing_else(task, kind):
    plain = pictures(task, NOMINAL)
    states = [task.sim.data[e].qpos.copy() for e in range(3)]
    keyframes = [task.keyframes(e, task.sim.q(e)).q for e in range(3)]
    changed = pictures(task, KINDS[kind])
    assert all((changed[e] != plain[e]).mean() > 0.01 for e in range(3))
    for e in range(3):
        np.testing.assert_array_equal(task.sim.data[e].qpos, states[e])
        np.testing.assert_array_equal(task.keyframes(e, task.sim.q(e)).q, keyframes[e])
    np.testing.assert_array_equal(pictures(task, NOMINAL), plain)


@pytest.mark.parametrize("kind", KINDS)
def test_a_draw_is_its_seed_s_in_whatever_lane(task, kind):
    first = pictures(task, KINDS[kind])
    again = pictures(task, KINDS[kind], (6, 4, 5))
    np.testing.assert_array_equal(first[[2, 0, 1]], again)


def test_once_an_episode_or_anew_for_each_picture(task):
    for each in (False, True):
        pictures(task, Perturbation(yaw=10, pitch=5, translation=0.02, each_query=each))
        turns = [task.eyes.drawn[0].turn]
        for _ in range(3):
            task.observe([0])
            turns.append(task.eyes.drawn[0].turn)
        assert len(np.unique(turns, axis=0)) == (4 if each else 1)


def test_draws_fill_their_bounds():
    bounds = Perturbation(yaw=10, pitch=5, translation=0.02)
    draws = [draw(bounds, seed, 0, 6) for seed in range(500)]
    for values, most in (
        (np.array([d.turn[0] for d in draws]), np.radians(10)),
        (np.array([d.turn[1] for d in draws]), np.radians(5)),
        (np.array([d.shift for d in draws]).ravel(), 0.02),
    ):
        assert 0.95 * most < np.abs(values).max() <= most
        assert abs(values.mean()) < 0.1 * most
    assert np.isnan(draws[0].distractor).all()


def test_a_camera_turns_about_its_own_axes_and_shifts_along_them():
    """Yaw leaves its upright axis where it is, pitch its sideways axis: no roll."""
    rng = np.random.default_rng(0)
    quat, position = rng.normal(size=4), rng.normal(size=3)
    quat /= np.linalg.norm(quat)

    def axes(quat):
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, quat)
        return matrix.reshape(3, 3)

    drawn = draw(Perturbation(), 0, 0, 1)
    for index, kept in ((0, 1), (1, 0)):
        turn = np.zeros(2)
        turn[index] = 0.2
        new, place = turned(quat, position, drawn._replace(turn=turn))
        np.testing.assert_allclose(axes(new)[:, kept], axes(quat)[:, kept], atol=1e-12)
        cosine = axes(new)[:, 2] @ axes(quat)[:, 2]
        assert np.arccos(cosine) == pytest.approx(0.2)
        np.testing.assert_array_equal(place, position)
    shift = np.array([0.01, -0.02, 0.03])
    new, place = turned(quat, position, drawn._replace(shift=shift))
    np.testing.assert_allclose(axes(quat).T @ (place - position), shift, atol=1e-12)


def test_noise_has_its_spread_and_is_clamped():
    drawn = draw(Perturbation(noise=0.05), 0, 0, 1)
    grey = with_noise(np.full((80, 80, 3), 128, np.uint8), drawn).astype(float)
    assert grey.std() == pytest.approx(0.05 * 255, rel=0.05)
    white = with_noise(np.full((80, 80, 3), 255, np.uint8), drawn)
    assert (white == 255).mean() > 0.45


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"yaw": 50}, "yaw 50, expected a number, 0 to 45"),
        ({"translation": -0.01}, "translation -0.01, expected a number, 0 to 0.1"),
        ({"noise": float("nan")}, "noise nan"),
        ({"light": 2.0}, "light 2.0, expected a number, 0 to 1"),
    ],
)
def test_what_is_out_of_range_is_refused(settings, line):
    with pytest.raises(ValueError, match=line):
        Perturbation(**settings)

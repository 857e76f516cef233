"""Mugs drawn from seeds: what is drawn, that physics, planning and pictures agree on it."""

import numpy as np
import pytest

from jaxplan import tasks
from jaxplan.config import PAPER_PLANNER
from jaxplan.demonstrations import ExpertAgent
from jaxplan.demonstrations.expert import CLEAN
from jaxplan.episodes import run_episodes
from jaxplan.evaluation.certification import Certification
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.expert import Expert
from jaxplan.tasks.mug.mug import (
    MugShape,
    collision_boxes,
    planning_geoms,
    planning_spheres,
)
from jaxplan.tasks.mug.mugs import RANGES, mug_of
from jaxplan.tasks.perturbation import Perturbation

DRAWN = {name: [mug_of(name, seed) for seed in range(300)] for name in RANGES}


@pytest.fixture(scope="module")
def task():
    return tasks.load("mug", 3, objects="train")


def numbers(shape: MugShape) -> dict[str, float]:
    """What `MugRange` bounds."""
    return {
        "radius": shape.radius,
        "height": shape.height,
        "handle_depth": shape.handle_reach - shape.radius,
        "handle_length": shape.handle_high - shape.handle_low,
        "mass": shape.mass,
    }


@pytest.mark.parametrize("name", RANGES)
def test_draws_fill_their_spans_and_nothing_else(name):
    for field in numbers(MugShape()):
        values = np.array([numbers(shape)[field] for shape in DRAWN[name]])
        spans = getattr(RANGES[name], field)
        for low, high in spans:
            inside = values[(values >= low - 1e-9) & (values <= high + 1e-9)]
            assert np.ptp(inside) > 0.9 * (high - low)
        within = [(values >= a - 1e-9) & (values <= b + 1e-9) for a, b in spans]
        assert np.any(within, axis=0).all()


def test_what_is_held_out_is_beyond_what_is_trained_on():
    for field in numbers(MugShape()):
        low, high = getattr(RANGES["train"], field)[0]
        values = np.array([numbers(shape)[field] for shape in DRAWN["held_out"]])
        assert ((values < low) | (values > high)).all(), field
        assert low < numbers(MugShape())[field] < high


def test_a_mug_is_its_seed_s():
    assert mug_of("train", 5) == mug_of("train", 5)
    assert mug_of("train", 5) != mug_of("train", 6)


@pytest.mark.parametrize("name", RANGES)
def test_planning_sees_what_the_mjcf_has(name):
    """Names, places and sizes, to the bit."""
    for shape in DRAWN[name][:3]:
        model = scene.build("planning", shape)
        for geom, (pos, size) in planning_geoms(shape).items():
            np.testing.assert_array_equal(model.geom(geom).pos, pos)
            np.testing.assert_array_equal(model.geom(geom).size, size)


@pytest.mark.parametrize("name", RANGES)
def test_planning_spheres_cover_every_mug(name):
    """The outside of wall and handle sticks out by 3 mm at most, and the planner's margin is 4."""
    for shape in DRAWN[name][:40]:
        spheres = planning_spheres(shape)
        centres, radii = map(np.array, zip(*spheres, strict=True))
        surface = []
        for box, centre, half, angle in collision_boxes(shape):
            if box.startswith("bottom"):
                continue
            grid = np.array(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3)).reshape(3, -1).T
            points = grid[(np.abs(grid) == 1).any(1)] * half
            c, s = np.cos(angle), np.sin(angle)
            turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + centre
            if box.startswith("wall"):
                far = np.hypot(turned[:, 0], turned[:, 1])
                turned = turned[far > shape.radius - shape.wall / 2]
            surface.append(turned)
        points = np.concatenate(surface)
        outside = np.linalg.norm(points[:, None] - centres, axis=2) - radii
        assert outside.min(axis=1).max() < 0.003 < PAPER_PLANNER.margin


def test_physics_has_the_mug_s_mass_and_is_usual_without_it(task):
    task.reset(range(3), (1, 2, 3))
    for lane, seed in enumerate((1, 2, 3)):
        model, shape = task.sim.data[lane].model, mug_of("train", seed)
        assert task.shapes[lane] == shape
        assert model.body("mug").mass[0] == pytest.approx(shape.mass)
        assert model.geom("mug_wall0").size[2] == shape.height / 2
        np.testing.assert_allclose(model.material("mug").rgba[:3], shape.colour, 1e-6)
        inertia, usual = model.body("mug").inertia, task.model.body("mug").inertia
        assert np.abs(inertia / usual - 1).max() > 0.01
    usual = tasks.load("mug", 1)
    usual.reset([0], [1])
    assert usual.sim.data[0].model is usual.model
    assert usual.shapes == [MugShape()]
    assert usual.planning_scene.shaped == ()


@pytest.mark.parametrize(
    "perturbation", [Perturbation(), Perturbation(light=0.5, colours=0.5)]
)
def test_an_episode_is_its_seed_s_in_whatever_lane(task, perturbation):
    """State, picture, keyframes and world, bit for bit."""
    task.eyes.perturbation = perturbation

    def told(seeds):
        task.reset(range(3), seeds)
        images = task.observe(range(3)).images["hand"]
        worlds = task.worlds(np.zeros(3, bool))
        return {
            seed: (
                task.sim.data[e].qpos.copy(),
                images[e],
                task.keyframes(e, task.sim.q(e)).q,
                *(np.asarray(leaf)[e] for leaf in worlds),
            )
            for e, seed in enumerate(seeds)
        }

    first, again = told((4, 5, 6)), told((6, 4, 5))
    for seed, values in first.items():
        for one, other in zip(values, again[seed], strict=True):
            np.testing.assert_array_equal(one, other)
    assert (first[4][1] != first[5][1]).any()
    task.eyes.perturbation = Perturbation()


def test_pictures_show_the_mug_s_colour_and_size(task):
    """As a task of that mug alone would show it."""
    task.reset([0, 1], [7, 8])
    task.observe([1])
    seen = task.observe([0]).images["hand"][0]
    alone = tasks.load("mug", 1, objects="train")
    alone.reset([0], [7])
    np.testing.assert_array_equal(seen, alone.observe([0]).images["hand"][0])


def test_the_expert_solves_mugs_of_all_shapes(task):
    """And C MuJoCo, told of each shape, refuses none of its paths."""
    expert = ExpertAgent(task, CLEAN)
    certification = Certification(expert.planner)
    records = []
    for name in ("train", "held_out"):
        task.draw(name)
        records += run_episodes(task, expert, range(3), listeners=[certification])
    task.draw("train")
    assert [record.failure for record in records] == [None] * 6
    summary = certification.summary()
    assert summary["paths_refused"] == summary["motions_invalid"] == 0


def test_a_long_handle_has_its_place_in_the_box(task):
    """The mug stands beside the middle by what the handle is too long."""
    place = {}
    for reach in (0.076, 0.090):
        expert = Expert(task.kinematics, MugShape(handle_reach=reach))
        mug = np.eye(4)
        mug[:3, 3] = 0.48, 0.0, 0.3
        q = expert.keyframes(mug, task.sim.q(0), closed=False).q[-1]
        place[reach] = expert.keyframes(mug, q, closed=True)
    ends = [task.kinematics.pose(k.q[-1])[0] for k in place.values()]
    # The hand is 14 mm further out on the mug, and the mug 14 mm further in.
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)


def test_bad_input_is_refused(task):
    with pytest.raises(
        ValueError, match="objects 'many' of mug: one or train or held_out"
    ):
        tasks.load("mug", 1, objects="many")
    with pytest.raises(
        ValueError, match="objects 'one' in a task that was made with 'train'"
    ):
        task.draw("one")

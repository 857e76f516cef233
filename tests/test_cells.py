"""Samplers for any scene: problems are read and drawn, paths recorded, weights trained and used."""

import dataclasses
import json
import pickle
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxplan
from jaxplan import (
    Obstacle,
    Planner,
    PlannerConfig,
    Scene,
    cli,
    data,
    make_world,
    train,
)
from jaxplan.cells import Cell, CellRecorder, RecordConfig, read_problem, record
from jaxplan.collision import XLA_OPTIONS
from jaxplan.collision.kinematics import frame_pose
from jaxplan.learning.weights import Weights, WeightsError
from jaxplan.networks import SceneCond, SurroundingsConfig
from jaxplan.networks.surroundings import Surroundings
from jaxplan.pretrained import load_sampler, save_weights
from jaxplan.samplers import FAMILIES, SceneSampler, init
from jaxplan.samplers.scene import ENCODING, conditions_in
from jaxplan.scene.identity import difference, identity
from jaxplan.trainings import scene_sampler

ARM = Path(__file__).parents[1] / "docs" / "arm.xml"
CELL = {
    "obstacles": [
        {
            "kind": "box",
            "size": [[0.02, 0.02, 0.05], [0.05, 0.1, 0.2]],
            "position": [[0.2, -0.4, 0.1], [0.5, 0.4, 0.4]],
            "yaw": [-1.5, 1.5],
            "share": 0.7,
        },
        {"kind": "sphere", "size": [0.05], "position": [-0.3, 0.2, 0.5]},
    ],
    "objects": {"cup": {"position": [[0.1, -0.6, 0.08], [0.2, -0.5, 0.08]]}},
    "start": "home",
    "goal": {"from": [-2, -1, -1, -1], "to": [2, 1, 1, 1]},
}
SLOTS = {"box": 1, "sphere": 1}
QUICK = RecordConfig(
    ways=2,
    shard_size=4,
    planner=PlannerConfig(max_expansions=2000),
)


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(Scene.from_mjcf(ARM, slots=SLOTS), QUICK.planner)


@pytest.fixture(scope="module")
def recorder(planner) -> CellRecorder:
    cell = Cell(planner, CELL)
    return CellRecorder(planner, lambda number: cell.draw(0, number), QUICK)


@pytest.fixture(scope="module")
def shard(recorder) -> data.PathShard:
    return recorder.shard(range(4))


def untrained(name: str, shard: data.PathShard, scene: Scene) -> Weights:
    """A family's weights as they are before training."""
    family = FAMILIES[name]
    network = scene_sampler.fitted(scene_sampler.settings(family).network, shard)
    params = init(network, jax.random.key(0), training=False)
    params = jax.tree.map(np.asarray, params)
    info = {"scene": identity(scene), "encoding": ENCODING, "file": f"{name}.npz"}
    return Weights(network, params, info)


# Problems


def test_what_is_drawn_is_free_within_its_ranges_and_by_its_number_alone(planner):
    cell, again = (Cell(planner, CELL) for _ in range(2))
    again.draw(0, 5)
    for number in range(12):
        problem, same = cell.draw(0, number), again.draw(0, number)
        for one, other in zip(
            jax.tree.leaves(problem), jax.tree.leaves(same), strict=True
        ):
            np.testing.assert_array_equal(one, other)
        ends = np.stack([problem.q_start, np.asarray(problem.goal)])
        assert (planner.clearance(ends, problem.world) > 0).all()
        np.testing.assert_array_equal(ends[0], [0, -0.6, 1.4, 0.8])
        assert (np.abs(ends[1]) <= [2, 1, 1, 1]).all()
        box, sphere = np.asarray(problem.world.slot_pose)
        assert box[2] == 1000 or (box[:3] >= [0.2, -0.4, 0.1]).all()
        np.testing.assert_allclose(sphere[:3], [-0.3, 0.2, 0.5], atol=1e-6)
        cup = np.asarray(problem.world.object_pose)[0]
        assert -0.6 <= cup[1] <= -0.5
    drawn = {float(cell.draw(0, n).world.slot_pose[0, 0]) for n in range(12)}
    assert len(drawn) > 5


@pytest.mark.parametrize("goal", [None, "left", [0.1, 0.2, 0.3, 0.4]])
def test_each_kind_of_end(planner, goal):
    problem = Cell(planner, {"start": "home", "goal": goal}).draw(3, 1)
    assert np.shape(np.asarray(problem.goal)) == (4,)
    if isinstance(goal, list):
        np.testing.assert_array_equal(problem.goal, goal)


def test_a_goal_that_is_a_pose_is_reached(planner):
    where = {"body": "hand", "position": [[0.2, 0.2, 0.3], [0.3, 0.3, 0.5]]}
    problem = Cell(planner, {"start": "home", "goal": where}).draw(0, 0)
    hand = partial(frame_pose, planner.scene, body="hand")
    ask = jax.jit(hand, compiler_options=XLA_OPTIONS)
    pose = ask(problem.world, jnp.asarray(problem.goal))
    assert (np.asarray(pose)[:, 3] >= np.array([0.2, 0.2, 0.3]) - 0.002).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"goals": "home"}, "a description with 'goals'"),
        ({"goal": "nowhere"}, "key frame"),
        ({"goal": [1, 2]}, "expected 4 numbers"),
        ({"goal": {"from": [0, 0, 0, 0]}}, "from or to alone"),
        (
            {"goal": {"from": [1, 0, 0, 0], "to": [0, 0, 0, 0]}},
            "from .*above|above the",
        ),
        ({"goal": {"body": "hand"}}, "a pose without position"),
        ({"goal": {"body": "head", "position": [0, 0, 1]}}, "head"),
        ({"obstacles": [{"kind": "box", "size": [1, 1, 1]}]}, "without position"),
        ({"obstacles": [{"kind": "cone", "size": [1], "position": [0, 0, 0]}]}, "cone"),
        (
            {"obstacles": [{"kind": "box", "size": ["a"], "position": [0, 0, 0]}]},
            "expected numbers",
        ),
        ({"objects": {"mug": {"position": [0, 0, 0]}}}, "mug"),
        ({"start": "home", "goal": [0, 2, 2, 2]}, "no free start and goal"),
    ],
)
def test_a_description_that_makes_no_sense_is_refused_in_a_line(planner, given, said):
    with pytest.raises(ValueError, match=said) as caught:
        Cell(planner, given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"start": "home"}, "without goal"),
        ({"start": "home", "goal": "left", "end": 1}, "a problem with 'end'"),
        ({"start": [0, 0, 0, "x"], "goal": "left"}, "could not convert|expected"),
        ({"start": "home", "goal": {"body": "hand", "at": 1}}, "a pose with 'at'"),
        (
            {"start": "home", "goal": "left", "obstacles": [{"kind": "box"}]},
            "without size",
        ),
        ({"start": "home", "goal": "left", "objects": {"cup": [1, 2]}}, "cup at"),
    ],
)
def test_a_problem_that_makes_no_sense_is_refused_in_a_line(planner, given, said):
    with pytest.raises(ValueError, match=said):
        read_problem(planner.scene, given)


# Paths


def test_paths_lead_from_start_to_goal_and_are_free(planner, shard):
    cell = Cell(planner, CELL)
    assert len(shard.problem) >= 4
    for path, number in zip(shard.path_q, shard.problem, strict=True):
        problem = cell.draw(0, int(number))
        np.testing.assert_allclose(path[0], problem.q_start, atol=1e-5)
        np.testing.assert_allclose(path[-1], np.asarray(problem.goal), atol=1e-5)
        assert planner.certify(path, problem.world, tolerance=0.005).valid
    gaps = np.linalg.norm(np.diff(shard.path_q, axis=1), axis=-1)
    assert gaps.max() <= shard.path_length.max() / 63 + 1e-3


def test_a_problem_is_recorded_alike_beside_others(recorder, shard):
    other = recorder.shard(range(2, 4))
    rows = np.isin(shard.problem, [2, 3])
    for name in ("path_q", "state", "things", "there"):
        np.testing.assert_array_equal(getattr(shard, name)[rows], getattr(other, name))


def test_unsolved_problems_are_named(planner):
    """A start inside an obstacle: no path, and a reason."""
    world = make_world(
        planner.scene, obstacles=[Obstacle("sphere", [0.3], [0.3, 0, 0.3])]
    )
    home = np.array([0, -0.6, 1.4, 0.8])
    problem = jaxplan.cells.Problem(home, home + 0.1, world)
    found = CellRecorder(planner, lambda _: problem, QUICK).shard(range(2))
    assert not len(found.problem)
    assert "collision" in found.reason[0]
    assert found.path_q.shape == (0, 64, 4)


# What a sampler is told


def test_the_order_of_things_and_empty_slots_change_nothing():
    rng = np.random.default_rng(0)
    state, things = rng.normal(size=(2, 11)), rng.normal(size=(2, 5, 9))
    there = np.array([[1, 1, 0, 1, 0], [0, 0, 0, 0, 0]], bool)
    network: Any = Surroundings(SurroundingsConfig(11, 9, 32, 24), 16)
    cond = SceneCond(*map(jnp.asarray, (state[:, :4], state, things, there)))
    params = network.init(jax.random.key(0), cond)
    vector = network.apply(params, cond)
    order = np.array([3, 4, 0, 2, 1])
    moved = cond._replace(things=cond.things[:, order], there=cond.there[:, order])
    np.testing.assert_allclose(network.apply(params, moved), vector, atol=1e-6)
    more = jnp.pad(cond.things, ((0, 0), (0, 3), (0, 0)), constant_values=7.0)
    padded = cond._replace(things=more, there=jnp.pad(cond.there, ((0, 0), (0, 3))))
    np.testing.assert_allclose(network.apply(params, padded), vector, atol=1e-6)
    other = cond._replace(things=cond.things.at[0, 0].add(1.0))
    assert np.abs(network.apply(params, other) - vector)[0].max() > 1e-3


def test_joints_that_come_round_are_told_alike_whatever_their_turn():
    scene = Scene.from_mjcf("""
      <mujoco><worldbody><body><joint name="a" axis="0 0 1"/><geom size="0.1"/>
      <body pos="0.3 0 0"><joint name="b" axis="0 1 0" range="-1 1"/>
      <geom type="capsule" size="0.05" fromto="0 0 0 0.3 0 0"/></body></body>
      <geom type="box" size="0.1 0.1 0.1" pos="0.6 0 0"/></worldbody></mujoco>""")
    assert list(scene.circular) == [True, False]
    world = jax.tree.map(lambda leaf: np.stack([leaf] * 2), make_world(scene))
    start = np.array([[3.0, 0.5], [3.0 - 2 * np.pi, 0.5]], np.float32)
    goal = np.array([[-3.0, 0.1], [-3.0 + 4 * np.pi, 0.1]], np.float32)
    known = conditions_in(scene)(world, start, goal)
    np.testing.assert_allclose(known.state[0], known.state[1], atol=1e-5)
    way = known.state[0][9:11]  # three times two joints and a cosine stand before it
    np.testing.assert_allclose(way, [2 * np.pi - 6, -0.4], atol=1e-5)
    assert known.things.shape[1] == 0


# Samplers


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.long
def test_any_weights_leave_the_planner_complete_and_alike_in_batches(
    name, planner, shard
):
    """Untrained weights propose nonsense: problems are solved all the same."""
    scene = planner.scene
    sampler = SceneSampler(untrained(name, shard, scene))
    guided = Planner(scene, PlannerConfig(max_expansions=5000), sampler=sampler)
    cell = Cell(planner, CELL)
    problems = [cell.draw(1, number) for number in range(5)]
    plans = guided.plan_batch(
        np.stack([p.q_start for p in problems]),
        [p.goal for p in problems],
        worlds=[p.world for p in problems],
    )
    assert all(plan.solved for plan in plans)
    for seed in (0, 3):
        alone = guided.plan(
            problems[seed].q_start, problems[seed].goal, seed, problems[seed].world
        )
        np.testing.assert_array_equal(alone.path, plans[seed].path)
        assert alone.expansions == plans[seed].expansions
    if name != "cvae":  # it compiles anew
        return
    copied = pickle.loads(pickle.dumps(guided))
    same = copied.plan(problems[3].q_start, problems[3].goal, 3, problems[3].world)
    np.testing.assert_array_equal(same.path, plans[3].path)


def test_another_scene_is_refused_by_name(shard, planner):
    sampler = SceneSampler(untrained("cvae", shard, planner.scene))
    for other, said in (
        (Scene.from_mjcf(ARM), "slots"),
        (Scene.from_mjcf(ARM, ["turn", "lift"], slots=SLOTS), "joints"),
        (
            planner.scene.replace(geom_size=planner.scene.model.geom_size + 0.01),
            "sizes",
        ),
    ):
        with pytest.raises(WeightsError, match=said):
            Planner(other, sampler=sampler)
    Planner(Scene.from_mjcf(ARM, slots=SLOTS), sampler=sampler)
    assert difference(identity(planner.scene), sampler.scene) is None


def test_weights_that_see_pictures_are_refused():
    weights = jaxplan.pretrained.load_weights("cvae")
    with pytest.raises(WeightsError, match="sees pictures"):
        SceneSampler(weights)


# The door


@pytest.mark.long
def test_from_a_description_to_a_guided_plan(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("cell.json").write_text(json.dumps(CELL))
    command = ["record", str(ARM), "--problems", "cell.json", "--out", "data/cell"]
    command += ["--ways", "2", "--expansions", "200"]
    assert cli.main([*command, "--count", "20"]) == 0
    assert "problems solved" in capsys.readouterr().out
    common = ["--data", "data/cell", "--out", "weights", "--steps", "8"]
    common += ["--batch-size", "16", "--val-segments", "4"]
    assert train.main(["scene_sampler", *common]) == 0
    assert train.main(["scene_few_step", *common, "--teacher", "weights"]) == 0
    assert train.main(["scene_cvae", *common]) == 0
    assert load_sampler("weights").bank.config.num_inference_steps == 1
    assert load_sampler("weights", "cvae").bank.config.latent == 8
    asked = ["plan", str(ARM), "--start", "home", "--goal", "left"]
    Path("obstacles.json").write_text(
        json.dumps(
            {
                "obstacles": [
                    {"kind": "box", "size": [0.05, 0.05, 0.1], "pose": [0.4, 0.1, 0.3]}
                ],
                "objects": {"cup": [0.1, -0.55, 0.08]},
            }
        )
    )
    asked += ["--obstacles", "obstacles.json", "--sampler", "weights"]
    assert cli.main([*asked, "--out", "answer"]) == 0
    assert json.loads(Path("answer/plan.json").read_text())["certified"]["motion"]

    # What does not go together is said in a line.
    assert cli.main(command) == 2
    assert "--count" in capsys.readouterr().err
    assert cli.main([*asked[:-1], str(jaxplan.pretrained.DIRECTORY)]) == 2
    assert "sees pictures" in capsys.readouterr().err
    other = Path("other.xml")
    other.write_text(ARM.read_text().replace('size="0.07"', 'size="0.08"'))
    assert cli.main(["plan", str(other), *asked[2:]]) == 2
    assert "another scene" in capsys.readouterr().err
    assert train.main(["sampler", "--data", "data/cell", "--steps", "1"]) == 2
    assert "no frames with subgoals" in capsys.readouterr().err


def test_a_recording_that_was_stopped_ends_with_the_same_bytes(
    tmp_path, recorder, monkeypatch
):
    whole, part = tmp_path / "whole", tmp_path / "part"
    record(whole, 10, recorder, {})
    made, calls = CellRecorder.shard, []

    def stopped(self, numbers):
        calls.append(numbers)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return made(self, numbers)

    monkeypatch.setattr(CellRecorder, "shard", stopped)
    with pytest.raises(KeyboardInterrupt):
        record(part, 10, recorder, {})
    assert len(list(part.glob("shard_*"))) == 1
    (part / "shard_00000.npz").write_bytes(b"torn")
    record(part, 10, recorder, {})
    assert len(calls) == 5
    for file in sorted(whole.iterdir()):
        assert file.read_bytes() == (part / file.name).read_bytes()
    with pytest.raises(data.DataError, match="was made with settings"):
        record(part, 11, recorder, {})


def test_weights_of_a_scene_survive_the_disk(tmp_path, shard, planner):
    weights = untrained("few_step", shard, planner.scene)
    save_weights(tmp_path, "few_step", weights.params, weights.config, weights.info)
    read = load_sampler(tmp_path)
    assert read.scene == identity(planner.scene)
    assert read.bank.config == weights.config
    assert dataclasses.asdict(read.bank.config)["surroundings"]["thing"] > 0


@pytest.mark.slow
def test_the_script_that_compares_samplers_solves_everything(tmp_path):
    """Quick, on the tutorial's cell; hardly trained samplers cost time and no answer."""
    root = ARM.parents[1]
    command = [sys.executable, str(root / "eval" / "scene_sampler.py"), "--quick"]
    command += ["--cell", str(ARM), "--description", str(root / "docs" / "cell.json")]
    command += ["--work", "work", "--out", "out.json"]
    subprocess.run(command, cwd=tmp_path, check=True)
    rows = json.loads((tmp_path / "out.json").read_text())["rows"]
    assert {*rows} == {"cell", "all"}
    for row in rows["all"].values():
        assert row["solved"] == row["of"] == 2

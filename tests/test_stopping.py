"""Searches that find nothing: time limits, Ctrl-C, enclosed ends."""

import os
import subprocess
import sys

import numpy as np
import pytest

from jaxplan import Planner, PlannerConfig, Scene, Status

ROOM = """<mujoco><worldbody>
  <geom type="box" size=".01 .3 1" pos=".3 0 0"/><geom type="box" size=".01 .3 1" pos="-.3 0 0"/>
  <geom type="box" size=".3 .01 1" pos="0 .3 0"/><geom type="box" size=".3 .01 1" pos="0 -.3 0"/>
  <body><joint type="slide" axis="1 0 0" range="-2 2"/>
    <joint type="slide" axis="0 1 0" range="-2 2"/><geom size="{size}"/></body>
</worldbody></mujoco>"""


@pytest.fixture(scope="module")
def room() -> Planner:
    """A robot in a room, which it cannot leave."""
    scene = Scene.from_mjcf(ROOM.format(size=0.05))
    planner = Planner(scene, PlannerConfig(max_expansions=1_000_000))
    planner.plan([0, 0], [0.1, 0])  # compiles
    return planner


def test_a_time_limit_ends_a_search_with_its_best_node(room):
    plan = room.plan([0, 0], [1, 0], time_limit=0.2)
    assert plan.status == Status.TIME_OUT
    assert not plan.solved
    assert 0 < plan.expansions < 1_000_000
    gap = np.linalg.norm(plan.path[-1] - [1, 0])
    assert f"{gap:.3f} m from the goal" in plan.reason
    assert plan.reason.startswith("no path after 0.")
    np.testing.assert_allclose(plan.path[0], [0, 0], atol=1e-6)
    assert room.certify(plan).valid


def test_a_time_limit_leaves_easy_answers_alone(room):
    whole = room.plan([0, 0], [0.2, 0.1], seed=3)
    limited = room.plan([0, 0], [0.2, 0.1], seed=3, time_limit=60.0)
    assert whole.solved
    np.testing.assert_array_equal(whole.path, limited.path)
    assert whole.expansions == limited.expansions
    # In a batch, what is easy is answered and what is not is open.
    ends = np.array([[0.2, 0.1], [1, 0], [-0.2, 0.1], [0, 1]])
    plans = room.plan_batch(np.zeros((4, 2)), ends, time_limit=0.5)
    solved = [plan.solved for plan in plans]
    assert solved == [True, False, True, False]
    assert plans[1].status == plans[3].status == Status.TIME_OUT
    refused = room.plan_batch(np.zeros((2, 2)), [[0.3, 0], [9, 0]], time_limit=0.5)
    assert [plan.status for plan in refused] == [
        Status.GOAL_IN_COLLISION,
        Status.OUT_OF_LIMITS,
    ]


@pytest.mark.parametrize("wrong", [0, -1, np.nan, "soon", True])
def test_a_time_limit_that_makes_no_sense_is_refused(room, wrong):
    with pytest.raises(ValueError, match="time_limit"):
        room.plan([0, 0], [1, 0], time_limit=wrong)


@pytest.mark.parametrize(("start", "goal", "end"), [(0, 1, "start"), (1, 0, "goal")])
def test_an_enclosed_end_is_said(start, goal, end):
    tight = Scene.from_mjcf(ROOM.format(size=0.2899))
    planner = Planner(tight, PlannerConfig(max_expansions=2000))
    plan = planner.plan([start, 0], [goal, 0])
    assert plan.status == Status.BUDGET_EXHAUSTED
    assert f"the {end} seems enclosed" in plan.reason


INTERRUPTED = """
import os, signal, sys, threading
import numpy as np
from jaxplan import Planner, PlannerConfig, Scene

planner = Planner(Scene.from_mjcf(sys.argv[1]), PlannerConfig(max_expansions=1_000_000))
starts, goals = np.zeros((32, 2)), np.tile([1.0, 0], (32, 1))
planner.plan(starts[0], goals[0] / 10)
planner.plan_batch(starts, goals / 10)
for ask in (
    lambda: planner.plan(starts[0], goals[0]),
    lambda: planner.plan_batch(starts, goals),
):
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    try:
        ask()
    except KeyboardInterrupt:
        print("heard", flush=True)
"""


def test_ctrl_c_ends_a_search():
    """Alone and in threads: KeyboardInterrupt comes out of the call, which would take minutes."""
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, ROOM.format(size=0.05)],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ,
        check=False,
    )
    assert done.stdout.split() == ["heard", "heard"], done.stderr

"""Motions of the Planner among sheets of 1 mm, by C MuJoCo: as safe as their paths."""

import sys
from pathlib import Path

import pytest

from jaxplan import Planner, Scene

sys.path.append(str(Path(__file__).parents[1] / "eval"))

from motions import ARM, SCENES, SHEETS, Row, solved

QUESTIONS = 40
RESOLUTION, TOLERANCE = 0.004, 1e-4


@pytest.fixture(scope="module")
def planner() -> Planner:
    return Planner(Scene.from_mjcf(ARM, slots={"box": SHEETS}))


@pytest.mark.parametrize("name", SCENES)
def test_motions_are_as_safe_as_their_paths(planner, name):
    row = Row(name)
    for plan in solved(planner, name, QUESTIONS, row):
        timed = planner.time(plan)
        verdict = planner.certify(timed.q, plan.world, RESOLUTION, TOLERANCE)
        assert verdict.valid, (plan.seed, verdict)
        # A path that was found at points may touch between them; nothing else is refused.
        assert timed.free or not planner.certify(plan, None, RESOLUTION, 0.0).valid
    assert row.solved > 0.9 * QUESTIONS

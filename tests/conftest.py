"""What all tests share: JAX on the CPU, off-screen rendering, reproducible examples."""

import os

# Set before JAX or MuJoCo is imported; a value from outside wins (for -m gpu).
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MUJOCO_GL", "egl")

import pytest
from hypothesis import settings

# Compilation makes first examples slow, and the same examples every time make a failure
# belong to the change that caused it.
settings.register_profile("jaxplan", deadline=None, derandomize=True)
settings.load_profile("jaxplan")


@pytest.fixture(scope="session")
def mug_task():
    """Four lanes of the mug task; tests reset them as they please."""
    from jaxplan.tasks.mug.task import MugTask

    return MugTask(4)


@pytest.fixture(scope="session")
def mug_planner(mug_task):
    """A planner for four problems at a time, compiled once for all tests."""
    from jaxplan.config import PlannerConfig
    from jaxplan.motion import MotionPlanner
    from jaxplan.scene.panda import PANDA_LIMITS

    planner = PlannerConfig(p_uniform=1.0)
    return MotionPlanner(mug_task.planning_scene, PANDA_LIMITS, planner)

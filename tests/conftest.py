"""What all tests share: JAX on the CPU, off-screen rendering, reproducible examples."""

import os
import signal
from pathlib import Path
from typing import Any, NamedTuple

# Set before JAX or MuJoCo is imported; a value from outside wins (for -m gpu).
os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("MUJOCO_GL", "egl")
# Tests compile far more than they compute: LLVM's first level takes half the time of its last.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=1")

import jax
import pytest
from hypothesis import settings
from jaxtyping import install_import_hook

# Shapes in annotations are checked, in tests alone. Not of what is traced through a registered
# dataclass (Scene): JAX rebuilds such records of other things than arrays; nor where there are
# settings, which say themselves what is wrong with them.
SHAPED = [
    "jaxplan.diffusion",
    "jaxplan.learning.segments",
    "jaxplan.samplers.families",
]
install_import_hook(SHAPED, "beartype.beartype")

# Compilation makes first examples slow, and the same examples every time make a failure
# belong to the change that caused it.
settings.register_profile("jaxplan", deadline=None, derandomize=True)
settings.load_profile("jaxplan")

# Background jobs of a shell ignore Ctrl-C, and so would all that they start.
signal.signal(signal.SIGINT, signal.default_int_handler)

MAPS = Path("/proc/self/maps")
MANY = 20_000
"""A process may have 65,530 memory maps, and each compiled program takes some."""


@pytest.fixture(scope="module", autouse=True)
def forget_programs():
    """One process runs all tests: XLA crashes where it gets no more memory maps."""
    yield
    if MAPS.exists() and MAPS.read_bytes().count(b"\n") > MANY:
        jax.clear_caches()


@pytest.fixture(scope="session")
def mug_task():
    """Four lanes of the mug task; tests reset them as they please."""
    from jaxplan.tasks.mug.task import MugTask

    return MugTask(4)


@pytest.fixture(scope="session")
def mug_planner(mug_task):
    """A planner for four problems at a time, compiled once for all tests."""
    from dataclasses import replace

    from jaxplan.config import PAPER_PLANNER
    from jaxplan.motion import MotionPlanner
    from jaxplan.robots import PANDA

    planner = replace(PAPER_PLANNER, p_uniform=1.0)
    return MotionPlanner(mug_task.planning_scene, PANDA.limits, planner)


class Demonstration(NamedTuple):
    """A batch that the expert drove, and what was heard of it."""

    seeds: range
    records: list
    phases: list
    recorder: Any
    certification: Any


@pytest.fixture(scope="session")
def demonstrate(mug_task, mug_planner):
    """Lets the expert drive seeds, half of them with noise, and records them."""
    from jaxplan.demonstrations import DemonstrationConfig, ExpertAgent, Recorder
    from jaxplan.episodes import run_episodes
    from jaxplan.evaluation.certification import Certification

    def run(seeds) -> Demonstration:
        expert = ExpertAgent(mug_task, planner=mug_planner)
        recorder = Recorder(mug_task, expert, seeds, DemonstrationConfig())
        certification, phases = Certification(mug_planner), []
        listeners = phases.append, recorder, certification
        records = run_episodes(mug_task, expert, seeds, listeners=listeners)
        return Demonstration(seeds, records, phases, recorder, certification)

    return run


@pytest.fixture(scope="session")
def demonstration(demonstrate):
    return demonstrate(range(4))


@pytest.fixture(scope="module")
def demos(tmp_path_factory) -> str:
    """A directory of demonstrations small enough to learn from in a test."""
    from toy_demonstrations import demonstrations

    from jaxplan import data

    directory = tmp_path_factory.mktemp("demos")
    data.write_shard(data.shard_path(directory, 0), demonstrations())
    data.write_manifest(directory, {"made": "for a test"})
    return str(directory)


@pytest.fixture(scope="module")
def timed_demos(tmp_path_factory) -> str:
    """The same of whole episodes, for policies."""
    from toy_timed import timed

    from jaxplan import data

    directory = tmp_path_factory.mktemp("timed")
    data.write_shard(data.shard_path(directory, 0), timed())
    made = {"task": "mug", "camera": "hand", "robot": "panda"}
    data.write_manifest(directory, made)
    return str(directory)

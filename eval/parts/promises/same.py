"""R4, R18, R19: the same answer in any process and batch, nothing compiled twice, no leak."""

import gc
import hashlib
import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import jax
import numpy as np

import jaxplan
from jaxplan import Status
from jaxplan.collision import Obstacle
from jaxplan.evaluation.random_scenes import random_scene
from parts.promises.promise import Promise, Trial

ROOT = Path(__file__).resolve().parents[3]
ARM = ROOT / "docs" / "arm.xml"
PROBLEMS = 256
KINDS = {
    Status.SOLVED,
    Status.START_IN_COLLISION,
    Status.GOAL_IN_COLLISION,
    Status.BUDGET_EXHAUSTED,
}
"""Of answers: what explains one is compiled when it is first said."""


@cache
def _planner() -> jaxplan.Planner:
    return jaxplan.Planner(jaxplan.Scene.from_mjcf(ARM, slots={"box": 2}))


def _problem(number: int) -> tuple[np.ndarray, np.ndarray, jaxplan.World]:
    """A start and a goal, and two boxes about the arm."""
    planner, rng = _planner(), np.random.default_rng(number)
    places = rng.uniform([-0.6, -0.6, 0.1], [0.6, 0.6, 0.8], (2, 3))
    boxes = [
        Obstacle("box", rng.uniform(0.02, 0.15, 3).tolist(), place) for place in places
    ]
    world = jaxplan.make_world(planner.scene, obstacles=boxes)
    q = rng.uniform(planner.q_min, planner.q_max, (2, len(planner.q_min)))
    return *q, world


def _plan(number: int, seed: int) -> jaxplan.Plan:
    """The answer to a problem."""
    start, goal, world = _problem(number)
    return _planner().plan(start, goal, seed, world)


def _answers(numbers: Sequence[int]) -> list[str]:
    """Digests of what problems come to, asked together."""
    problems = [_problem(number) for number in numbers]
    starts, goals, worlds = zip(*problems, strict=True)
    plans = _planner().plan_batch(
        np.stack(starts), np.stack(goals), seeds=numbers, worlds=worlds
    )
    return [
        hashlib.sha256(
            plan.path.tobytes() + f"{plan.status} {plan.expansions}".encode()
        ).hexdigest()
        for plan in plans
    ]


def _batches(place: Path) -> Trial:
    """A batch of any size, in any order, against one problem at a time."""
    alone: dict[int, str] = {}

    def trial(numbers: range) -> list[str]:
        faults = []
        for size in (number % PROBLEMS + 1 for number in numbers):
            chosen = np.random.default_rng(size).permutation(PROBLEMS)[:size].tolist()
            found = _answers(chosen)
            for number, digest in zip(chosen, found, strict=True):
                if number not in alone:
                    alone[number] = _answers([number])[0]
                if digest != alone[number]:
                    faults.append(f"problem {number} in a batch of {size}")
        return faults

    return trial


ASK = """
import sys
sys.path[:0] = {paths!r}
from parts.promises.same import _answers
print(" ".join(_answers(range(16))))
"""


def _processes(place: Path) -> Trial:
    """A process of its own for each number, the same problems."""
    expected = _answers(range(16))
    program = ASK.format(paths=[str(ROOT), str(ROOT / "eval")])

    def trial(numbers: range) -> list[str]:
        faults = []
        for number in numbers:
            environment = {**os.environ, "PYTHONHASHSEED": str(number)}
            done = subprocess.run(
                [sys.executable, "-c", program],
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            if done.stdout.split() != expected:
                faults.append(f"process {number}: other paths; {done.stderr[-200:]}")
        return faults

    return trial


def _compilations(place: Path) -> Trial:
    """Problems, worlds and seeds that change compile nothing, once each kind was there."""
    counted: list[str] = []
    seen, first = set[Status](), 0
    while not seen >= KINDS:
        seen.add(_plan(first, first).status)
        first += 1
    jax.monitoring.register_event_duration_secs_listener(
        lambda event, *_, **__: (
            counted.append(event)
            if event.endswith("backend_compile_duration")
            else None
        )
    )

    def trial(numbers: range) -> list[str]:
        before = len(counted)
        for number in numbers:
            _plan(first + number, number)
        new = len(counted) - before
        return [f"{new} programs compiled in {len(numbers)} problems"] if new else []

    return trial


def _resident() -> int:
    """Memory of this process [bytes]."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def _memory(place: Path) -> Trial:
    """By how much it grows, the first tenth of the problems left out."""

    def ask(numbers: range) -> None:
        for number in numbers:
            _plan(number, number)

    def trial(numbers: range) -> list[str]:
        ask(range(len(numbers) // 10))
        before = _resident()
        ask(numbers)
        grown = _resident() / before - 1
        said = f"memory grew by {100 * grown:.2f} % over {len(numbers)} problems"
        return [said] if grown > 0.01 else []

    return trial


def _scenes(place: Path) -> Trial:
    """Memory after half of the scenes, and after all: what is kept of each is bounded."""

    def trial(numbers: range) -> list[str]:
        sizes = []
        for number in numbers:
            scene = random_scene(number, 4).read()
            planner = jaxplan.Planner(scene)
            q = np.clip(np.zeros(len(scene.joints)), planner.q_min, planner.q_max)
            planner.clearance(q[None])
            sizes.append(_resident())
        half = sizes[len(sizes) // 2]
        each = (sizes[-1] - half) / (len(sizes) / 2) / 2**20
        return [f"{each:.1f} MiB more for each scene"] if each > 1 else []

    return trial


PROMISES = (
    Promise(
        "R4",
        "another answer in a batch of another size or order (sizes 1 to 256)",
        256,
        64,
        _batches,
    ),
    Promise("R4p", "another answer in another process", 20, 5, _processes),
    Promise(
        "R18",
        "a program compiled once there was an answer of each kind",
        1000,
        1000,
        _compilations,
    ),
    Promise(
        "R19", "memory that grows by 1 % over 10,000 plans", 10_000, 10_000, _memory
    ),
    Promise("R19s", "memory that grows with each of 200 scenes", 200, 200, _scenes),
)

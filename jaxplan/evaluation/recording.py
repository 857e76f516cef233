"""Recording phase problems: the expert or the upper network predicts, the expert's planner drives.

No learned sampler has a part in it, so that none is favoured; whoever predicts is the same
for all of them (section 5.5: "we replace only the lower planner while keeping the upper
network fixed"). The expert's problems depend on the seeds alone.
"""

import hashlib
import itertools
from collections.abc import Callable, Sequence
from pathlib import Path

import jax
import numpy as np

from jaxplan import collision
from jaxplan.algorithm1 import Algorithm1
from jaxplan.base import Agent, Phase
from jaxplan.collision import World
from jaxplan.config import PAPER_PLANNER
from jaxplan.demonstrations import ExpertAgent
from jaxplan.demonstrations.expert import CLEAN
from jaxplan.episodes import run_episodes
from jaxplan.evaluation import problems as store
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.learned import Upper
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner, jit
from jaxplan.planning import points_for
from jaxplan.tasks import Tabletop

SHARD = 32
"""Episodes a shard, in lockstep."""


def record(
    task: Tabletop,
    variant: str,
    seeds: range,
    predictor: Weights | None,
    directory: Path = Path("runs/problems"),
    progress: Callable[[int], object] = lambda done: None,
) -> tuple[RecordedProblems, str]:
    """The problems of one episode a seed; those that are not there yet are made.

    Args:
        task: With `SHARD` lanes.
        variant: Of its scene.
        seeds: As many as fill shards of 32; more are recorded otherwise, and left out.
        predictor: The upper network; None = the expert predicts.
        directory: Each variant and predictor has its own inside.
        progress: Called with the number of episodes of each shard.

    Returns:
        The problems, and a name that stands for them.
    """
    upper = "expert" if predictor is None else predictor.info["sha256"]
    name = f"{variant}-{upper[:8]}"
    settings = {
        "variant": variant,
        "scene": fingerprint(task.planning_scene.mj_model),
        "upper": upper,
        "shard": SHARD,
    }
    first, end = seeds.start // SHARD, -(-seeds.stop // SHARD)
    names = [f"problems_{index:06d}.npz" for index in range(first, end)]
    there = store.begin(directory / name, settings)
    recorder = None
    for index, shard in zip(range(first, end), names, strict=True):
        if shard not in there:
            recorder = recorder or ProblemRecorder(task, predictor)
            part = recorder.run(range(index * SHARD, (index + 1) * SHARD))
            store.add(directory / name, shard, part)
        progress(SHARD)
    found = store.read(directory / name, names)
    rows = (seeds.start <= found.seed) & (found.seed < seeds.stop)
    return found.take(np.flatnonzero(rows)), name


def fingerprint(model) -> str:
    """Of what a model (`mujoco.MjModel`) holds: other obstacles pose other problems."""
    names = ("geom_type", "geom_size", "geom_pos", "geom_quat", "body_pos", "qpos0")
    digest = hashlib.sha256()
    for name in names:
        digest.update(np.round(getattr(model, name), 6).astype(np.float32).tobytes())
    return digest.hexdigest()[:16]


class ProblemRecorder:
    """Runs episodes and keeps the problems that they pose.

    Args:
        task: With `SHARD` lanes.
        predictor: The upper network; None = the expert predicts.
    """

    def __init__(self, task: Tabletop, predictor: Weights | None) -> None:
        self._task, scene = task, task.planning_scene
        planner = task.expert_planner()
        # The expert's planner takes some obstacles for thicker than the problems have them.
        self._judge = MotionPlanner(scene, task.robot.limits)
        self._agent: Agent = ExpertAgent(task, CLEAN, planner)
        if predictor is not None:
            self._agent = Algorithm1(task, planner, Upper(predictor, task.camera))
        points = points_for(1.0, PAPER_PLANNER.edge_resolution)
        self._free = jit(
            lambda worlds, q0, q1: collision.motion_free(
                scene, worlds, q0, q1, points, PAPER_PLANNER.margin
            )
        )
        self._rows: list[tuple] = []

    def run(self, seeds: Sequence[int]) -> RecordedProblems:
        """Problems of at most `SHARD` episodes."""
        self._seeds, self._rows = seeds, []
        self._toggles = np.zeros(len(seeds), int)
        self._closed = np.zeros(len(seeds), bool)
        records = run_episodes(self._task, self._agent, seeds, listeners=[self._listen])
        columns = [np.array(column) for column in zip(*self._rows, strict=True)]
        order = np.lexsort((columns[1], columns[0]))
        seed, phase, *others = (column[order] for column in columns)
        well = [record.seed for record in records if record.success]
        return RecordedProblems(seed, phase, np.isin(seed, well), *others)

    def _listen(self, phase: Phase) -> None:
        """Keeps a round's problems, but those of hands that back off for good."""
        seen, decision = phase.observation, phase.action.decision
        subgoal, worlds = decision.subgoal, decision.worlds
        ends = seen.q, subgoal.q_goal
        start, goal = (self._judge.nearest_free(worlds, q) for q in ends)
        free = self._straight(worlds, start, goal)
        worlds = jax.tree.map(np.asarray, worlds)
        for e in phase.lanes:
            closed = bool(seen.gripper[e])
            self._toggles[e] += closed != self._closed[e]
            self._closed[e] = closed
            if e in decision.leaving:
                continue
            self._rows.append(
                (
                    np.int32(self._seeds[e]),
                    np.int32(phase.number),
                    np.int8(self._toggles[e] % 4),
                    bool(decision.at_toggle[e]),
                    not free[e],
                    start[e],
                    goal[e],
                    subgoal.q_toggle[e].astype(np.float32),
                    np.uint8(subgoal.gripper_toggle[e]),
                    seen.images[self._task.camera][e],
                    seen.q[e],
                    np.uint8(closed),
                    subgoal.q_goal[e].astype(np.float32),
                    *(leaf[e] for leaf in worlds),
                )
            )

    def _straight(self, worlds: World, q0: np.ndarray, q1: np.ndarray) -> np.ndarray:
        """[B] whether the straight motions are free, in pieces of at most 1 rad."""
        length = np.linalg.norm(q1 - q0, axis=1)
        pieces = int(np.ceil(max(length.max(), 1e-6)))
        ends = np.linspace(0, 1, pieces + 1, dtype=np.float32)
        free = np.ones(len(q0), bool)
        for low, high in itertools.pairwise(ends):
            part = (q0 + share * (q1 - q0) for share in (low, high))
            free &= np.asarray(self._free(worlds, *part))
        return free

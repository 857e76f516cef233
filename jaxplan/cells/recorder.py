"""From problems to paths that a sampler learns from: solved, several ways each, in shards."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np
from tqdm import tqdm

from jaxplan import data
from jaxplan.cells.problem import Problem
from jaxplan.collision import World
from jaxplan.config import PlannerConfig
from jaxplan.data import PathShard, as_path_shard, resample
from jaxplan.motion import Planner
from jaxplan.networks import SceneCond
from jaxplan.ranges import Checked, Count, Whole
from jaxplan.samplers.scene import ENCODING, conditions_in
from jaxplan.scene.identity import identity


@dataclass(frozen=True)
class RecordConfig(Checked):
    """How problems are solved."""

    ways: Count = 4
    """Paths of each problem, each with a seed of its own."""
    seed: Whole = 0
    shard_size: Count = 64
    """Problems a shard."""
    planner: PlannerConfig = PlannerConfig()
    """With `ao_rrt_connect` a search goes on to the end of its budget, for ever shorter paths."""


def record(
    out: Path, total: int, recorder: "CellRecorder", settings: Mapping[str, Any]
) -> None:
    """Makes the shards that are missing of problems 0 to `total` - 1, and the manifest.

    Raises:
        DataError: The directory was begun with other settings.
    """
    size = recorder.config.shard_size
    settings = {
        **settings,
        "scene": identity(recorder.scene),
        "encoding": ENCODING,
        "count": total,
        "config": dataclasses.asdict(recorder.config),
    }
    out.mkdir(parents=True, exist_ok=True)
    parts = [range(i, min(i + size, total)) for i in range(0, total, size)]
    missing = data.missing_shards(out, len(parts), settings)
    data.write_manifest(out, settings)
    done = total - sum(len(parts[index]) for index in missing)
    with tqdm(total=total, unit="problem", initial=done) as bar:
        for index in missing:
            shard = recorder.shard(parts[index])
            data.write_shard(data.shard_path(out, index), shard)
            bar.update(len(parts[index]))
    data.write_manifest(out, settings)


class CellRecorder:
    """Makes shards.

    Args:
        planner: Of the scene, with the settings of `config`.
        pose: The problem of a number.
        config: How they are solved.
    """

    def __init__(
        self, planner: Planner, pose: Callable[[int], Problem], config: RecordConfig
    ) -> None:
        self._planner, self._pose, self.config = planner, pose, config
        self.scene = planner.scene
        self._conditions = conditions_in(planner.scene)

    def shard(self, numbers: Sequence[int]) -> PathShard:
        """The paths of some problems; the same wherever and beside whatever it is made."""
        ways, first = self.config.ways, self.config.seed
        problems = [self._pose(number) for number in numbers]
        posed = [problem for problem in problems for _ in range(ways)]
        of = np.repeat(np.array(numbers), ways)
        way = np.tile(np.arange(ways), len(problems))
        plans = self._planner.plan_batch(
            np.stack([problem.q_start for problem in posed]),
            [problem.goal for problem in posed],
            [int(seed) for seed in (first + of * ways + way) % 2**32],
            [problem.world for problem in posed],
        )
        plans = self._planner.shorten(plans)
        solved = [row for row, plan in enumerate(plans) if plan.solved]
        paths = [resample(plans[row].path) for row in solved]
        ends = [plans[row].path[[0, -1]] for row in solved]
        known = self._known(ends, [posed[row].world for row in solved], len(posed))
        of_problem = [plans[row : row + ways] for row in range(0, len(plans), ways)]
        return as_path_shard(
            {
                "d": len(self.scene.joints),
                "S": known.state.shape[1],
                "n": known.things.shape[1],
                "T": known.things.shape[2],
            },
            path_q=[q for q, _ in paths],
            path_length=[length for _, length in paths],
            state=np.asarray(known.state),
            things=np.asarray(known.things),
            there=np.asarray(known.there),
            problem=of[solved],
            posed=np.array(numbers),
            reason=[
                "" if any(plan.solved for plan in found) else found[0].reason
                for found in of_problem
            ],
        )

    def _known(
        self, ends: list[np.ndarray], worlds: list[World], size: int
    ) -> SceneCond:
        """What a sampler is told of each path's problem; compiles for one `size`."""
        count, d = len(ends), len(self.scene.joints)
        ends, worlds = [*ends, np.zeros((2, d))], [*worlds, self._planner.empty_world]
        rows = np.minimum(np.arange(size + 1), count)
        world = jax.tree.map(lambda *leaves: np.stack(leaves)[rows], *worlds)
        q = np.stack(ends).astype(np.float32)[rows]
        known = self._conditions(world, q[:, 0], q[:, 1])
        return jax.tree.map(lambda leaf: leaf[:count], known)

"""Which ways samplers propose where a problem can be solved by several.

    python eval/ways.py
    python eval/ways.py --quick

Recorded problems whose straight motion is blocked are solved once more by each way alone, the
others closed. What can be solved by two or more is what this is about: how many of a sampler's
proposals are free, how many of the ways get at least 5 % of them (`evaluation.coverage`: a proposal
belongs to the way whose closing takes it away), how far they are from the nearest way. Problems of
episodes that close a way are shown apart: the sampler is not told.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from tqdm import tqdm

from jaxplan import collision
from jaxplan.cli import run_script
from jaxplan.collision import Obstacle, World
from jaxplan.collision.obstacles import fill
from jaxplan.config import PAPER_PLANNER
from jaxplan.evaluation.coverage import ENOUGH, Coverage, coverage
from jaxplan.evaluation.problems import RecordedProblems
from jaxplan.evaluation.recorded_study import RecordedStudy, StudyArgs
from jaxplan.evaluation.recording import SHARD
from jaxplan.evaluation.result import Result
from jaxplan.evaluation.searches import KeptBanks
from jaxplan.evaluation.tables import Table
from jaxplan.motion import jit
from jaxplan.planning import points_for
from jaxplan.ranges import Count
from jaxplan.samplers import FAMILIES, Bank

AIM = 0.9, 0.95
"""Ways that ours covers, in this share of the phases."""


@dataclass(frozen=True)
class Args(StudyArgs):
    """Asks samplers for proposals on recorded problems."""

    variant: str = "ways"
    banks: Count = 8
    """Of proposals for each problem."""


class Proposed(NamedTuple):
    """A sampler's proposals for P problems."""

    free: np.ndarray
    """`[P]` share."""
    found: list[Coverage]


def main(args: Args) -> None:
    """Solves by each way, asks the samplers, prints tables, writes JSON."""
    start = time.perf_counter()
    study = RecordedStudy(args)
    if len(study.task.zones) < 2:
        raise ValueError(f"variant {args.variant!r}: its problems have one way each")
    rows = np.flatnonzero(study.problems.past_the_obstacle)
    rows, ways = by_each_way(study, rows)
    problems = study.problems.take(rows)
    points = points_for(PAPER_PLANNER.step_max, PAPER_PLANNER.edge_resolution)
    free = jit(
        lambda worlds, q0, q1: collision.motion_free(
            study.scene, worlds, q0, q1, points, PAPER_PLANNER.margin
        )
    )
    asked: dict[str, Proposed] = {}
    for name in tqdm(FAMILIES, desc="samplers"):
        if weights := study.weights(name):
            banks = KeptBanks(Bank(weights), study.cond, study.problems.keys())
            asked[name] = propose(study, free, problems, banks, rows, ways, args.banks)
    tables = [
        table(f"{words} ({int(some.sum())})", asked, some)
        for words, some in (
            ("nothing closed", ~problems.closed),
            ("a way closed", problems.closed),
        )
        if some.any()
    ]
    seconds = time.perf_counter() - start
    result = Result(tables, study.settings(), shortfalls(asked), args.quick, seconds)
    result.show()
    result.write(args.path("proposed"))
    print(f"written to {args.path('proposed')}")


def by_each_way(
    study: RecordedStudy, rows: np.ndarray
) -> tuple[np.ndarray, list[dict[str, np.ndarray]]]:
    """Of some problems those that two ways or more solve, and a path `[T, d]` by each."""
    planner, zones = study.task.expert_planner(), study.task.zones
    found: dict[int, dict[str, np.ndarray]] = {int(row): {} for row in rows}
    for left in tqdm(zones, desc="ways"):
        closed = [zone for name, zone in zones.items() if name != left]
        for first in range(0, len(rows), SHARD):
            part = rows[first : first + SHARD]
            lanes = np.pad(part, (0, SHARD - len(part)), mode="edge")
            some = closing(study, study.problems.take(lanes), closed)
            motion = planner.plan(
                jax.tree.map(jnp.asarray, some.worlds),
                some.q_start,
                some.q_goal,
                some.q_toggle,
                some.keys(),
                active=np.arange(SHARD) < len(part),
            )
            for lane, row in enumerate(part):
                if len(motion.q[lane]) > 1:
                    found[int(row)][left] = motion.q[lane][::4]
    several = [row for row, ways in found.items() if len(ways) > 1]
    return np.array(several, int), [found[row] for row in several]


def propose(
    study: RecordedStudy,
    free: Callable,
    problems: RecordedProblems,
    banks: KeptBanks,
    rows: np.ndarray,
    ways: list[dict[str, np.ndarray]],
    count: int,
) -> Proposed:
    """A sampler's proposals for problems `rows`, and how they lie."""
    draw = banks.of(rows)
    drawn = [draw(jnp.full(len(rows), number)) for number in range(count)]
    base = np.concatenate([np.asarray(part.base) for part in drawn], axis=1)
    ends = np.concatenate([np.asarray(part.end) for part in drawn], axis=1)
    limits = study.task.robot.limits
    ends = np.clip(ends, limits.q_min, limits.q_max).astype(np.float32)

    def free_in(worlds: World) -> np.ndarray:
        worlds = jax.tree.map(jnp.asarray, worlds)
        columns = zip(base.swapaxes(0, 1), ends.swapaxes(0, 1), strict=True)
        return np.stack([free(worlds, *column) for column in columns], axis=1)

    own = free_in(problems.worlds)
    all_open = free_in(closing(study, problems, []).worlds)
    lost = {
        name: all_open & ~free_in(closing(study, problems, [zone]).worlds)
        for name, zone in study.task.zones.items()
    }
    found = [
        coverage(
            np.stack([lost[name][i] for name in paths], axis=1),
            ends[i],
            list(paths.values()),
        )
        for i, paths in enumerate(ways)
    ]
    return Proposed(own.mean(axis=1), found)


def closing(
    study: RecordedStudy, problems: RecordedProblems, zones: Sequence[Obstacle]
) -> RecordedProblems:
    """The same problems with these zones, and no others."""
    pose, size = (np.asarray(leaf) for leaf in fill(study.scene, zones))
    many = len(problems.seed)
    return problems._replace(
        slot_pose=np.broadcast_to(pose, (many, *pose.shape)),
        slot_size=np.broadcast_to(size, (many, *size.shape)),
    )


def table(title: str, asked: dict[str, Proposed], some: np.ndarray) -> Table:
    """Samplers as rows, of some of the problems."""
    rows = []
    for name, proposed in asked.items():
        found = [c for c, kept in zip(proposed.found, some, strict=True) if kept]
        rows.append(
            [
                name,
                float(100 * proposed.free[some].mean()),
                float(100 * np.mean([c.covered.mean() for c in found])),
                float(100 * np.mean([c.covered.all() for c in found])),
                float(100 * np.median([c.shares.min() for c in found])),
                float(np.median([c.distance for c in found])),
            ]
        )
    columns = ["sampler", "free %", "ways covered %", "phases with all ways %"]
    columns += ["the rarest way gets %", "to the nearest way [rad]"]
    return Table(
        title,
        columns,
        rows,
        f"A way is covered by {ENOUGH:.0%} of them that would be lost with it.",
    )


def shortfalls(asked: dict[str, Proposed]) -> list[str]:
    """Where ours covers less than we want."""
    if "sampler" not in asked:
        return []
    ways, phases = AIM
    share = np.mean([c.covered.mean() >= ways for c in asked["sampler"].found])
    if share >= phases:
        return []
    return [
        f"diffusion covers {ways:.0%} of the ways in {share:.0%} of the phases "
        f"(aim {phases:.0%})"
    ]


if __name__ == "__main__":
    run_script(main, Args)

"""`jaxplan record`: paths in a robot's cell, several ways each, for a sampler to learn from."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from jaxplan import cells, data
from jaxplan.cells import (
    Cell,
    CellRecorder,
    Problem,
    RecordConfig,
    read_json,
    read_problem,
    slots_needed,
    slots_of,
)
from jaxplan.commands.model import read_scene
from jaxplan.motion import Planner
from jaxplan.scene import Scene


def record(
    path: Path,
    problems: Path | None,
    count: int | None,
    out: Path,
    joints: str | None = None,
    hand: str | None = None,
    config: RecordConfig = RecordConfig(),
) -> bool:
    """Solves problems and keeps their paths; begun again, it makes the shards that are missing.

    Args:
        path: Of the MJCF.
        problems: JSON with problems (`cells.problem`), or that describes them
            (`cells.description`); None: any start and goal among what the model has.
        count: How many are drawn; of given ones, the first so many.
        out: Directory of the shards.
        joints: See `commands.model.read_scene`.
        hand: See `commands.model.read_scene`.
        config: How they are solved.

    Returns:
        Whether any problem was solved.

    Raises:
        ValueError: Bad input.
        DataError: The directory was begun with other settings.
    """
    given = {} if problems is None else read_json(problems)
    if "problems" in given:
        listed = _checked(given["problems"])
        count = min(count or len(listed), len(listed))
        scene = read_scene(path, joints, hand, slots_of(listed))
        planner, pose = Planner(scene, config.planner), _listed(scene, listed)
    elif count is not None:
        scene = read_scene(path, joints, hand, slots_needed(given))
        planner = Planner(scene, config.planner)
        pose = partial(Cell(planner, given).draw, config.seed)
    else:
        raise ValueError("--count is needed where problems are drawn")
    recorder = CellRecorder(planner, pose, config)
    cells.record(out, count, recorder, {"problems": given})
    return _say(out)


def _checked(problems: Any) -> list[dict[str, Any]]:
    if not isinstance(problems, list) or not problems:
        raise ValueError("problems: expected a list of problems")
    if wrong := [each for each in problems if not isinstance(each, dict)]:
        raise ValueError(f"problems: {wrong[0]!r} is no problem")
    return problems


def _listed(scene: Scene, problems: list[dict[str, Any]]) -> Callable[[int], Problem]:
    found = []
    for number, each in enumerate(problems):
        try:
            found.append(read_problem(scene, each))
        except (ValueError, TypeError) as error:
            raise ValueError(f"problem {number}: {error}") from None
    return found.__getitem__


def _say(out: Path) -> bool:
    """What there is now, and what was not solved."""
    shard = data.read_demonstrations(out, data.PathShard)
    solved = shard.reason == ""
    ways = len(shard.problem) / max(1, solved.sum())
    print(
        f"{solved.sum()} of {len(solved)} problems solved, {len(shard.problem)} paths "
        f"({ways:.1f} each), {shard.path_length.mean() if len(shard.problem) else 0:.2f} rad long"
    )
    reasons, counts = np.unique(shard.reason[~solved], return_counts=True)
    for at in np.argsort(-counts)[:5]:
        print(f"  {counts[at]} not: {reasons[at]}")
    print(f"written: {out}")
    return bool(solved.any())

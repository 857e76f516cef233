"""What went wrong with the mug: which of the four contacts failed, and how."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from jaxplan.base import Phase
from jaxplan.episodes import EpisodeRecord
from jaxplan.tasks.tabletop import Tabletop
from jaxplan.tasks.watch import Watch, kind_of

UPRIGHT = np.cos(np.radians(20))
KINDS = (
    "missed rim",
    "dropped",
    "knocked over",
    "missed handle",
    "missed box",
    "no motion",
    "not finished",
)


class Seen(NamedTuple):
    """A lane at the start of a round, or at the end."""

    closed: bool
    held: bool
    upright: bool


class MugWatch(Watch):
    """Keeps how each lane stood at each round."""

    def __init__(self, task: Tabletop) -> None:
        self._task = task
        self._seen: dict[int, list[Seen]] = {}

    def __call__(self, phase: Phase) -> None:
        """Sees a round."""
        for lane in phase.lanes:
            self._seen.setdefault(lane, []).append(self._look(lane))

    def finish(self, records: Sequence[EpisodeRecord]) -> list[str | None]:
        """The kind of each failure, None for a success; begins anew."""
        kinds = []
        for lane, record in enumerate(records):
            seen = [*self._seen.get(lane, []), self._look(lane)]
            kinds.append(kind(seen, record.failure))
        self._seen = {}
        return kinds

    def _look(self, lane: int) -> Seen:
        task = self._task
        upright = task.object_pose(lane)[2, 2] > UPRIGHT
        return Seen(bool(task.closed[lane]), task.held(lane), bool(upright))


def kind(seen: Sequence[Seen], failure: str | None) -> str | None:
    """Of a failure, from how the mug and the gripper stood at each round and at the end."""
    if failure is None:
        return None
    if "range" in failure:
        return failure
    grasps = sum(now.held and not before.held for before, now in pairwise(seen))
    empty = any(now.closed and not now.held for now in seen)
    last = seen[-1]
    if grasps == 0:
        return "missed rim" if empty else kind_of(failure)
    if last.closed and not last.held:
        was_held = next(
            before.held and before.closed
            for before, now in zip(seen[-2::-1], seen[::-1], strict=False)
            if before != now
        )
        return "dropped" if was_held else "missed handle"
    if not last.upright and not last.held:
        return "knocked over"
    if grasps >= 2 and not last.closed:
        return "missed box"
    words = kind_of(failure)
    # Judged as over with the mug where it was put upright: the hand went on without it.
    return "missed handle" if empty or words == failure else words

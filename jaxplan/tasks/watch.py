"""Why episodes fail, by kind: what was seen of them on the way."""

from collections.abc import Sequence

from jaxplan.base import Phase
from jaxplan.episodes import EpisodeRecord


class Watch:
    """Listens to episodes; a task's own says more than this one."""

    def __call__(self, phase: Phase) -> None:
        """Sees a round."""

    def finish(self, records: Sequence[EpisodeRecord]) -> list[str | None]:
        """The kind of each failure, None for a success; begins anew."""
        return [kind_of(record.failure) for record in records]


def kind_of(failure: str | None) -> str | None:
    """A failure's words, without what is special about it."""
    if failure is None:
        return None
    for kind in ("no motion", "not finished"):
        if failure.startswith(kind):
            return kind
    return failure

"""Which contacts are left out besides the model's own, and why."""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import mujoco

from jaxplan.scene.names import geom_name, pair_of
from jaxplan.scene.touching import Moving, touching_pairs

ALWAYS = "always_touching"
"""Stands for what `touching_pairs` finds."""

Exclude = str | Iterable[str | Sequence[str]] | None
"""`ALWAYS`, pairs of bodies ("hand|cup" or ("hand", "cup")), both, or None."""


class Excluded(NamedTuple):
    """A contact that is left out."""

    a: str
    """A geom that always touches the other, or a body that was given."""
    b: str
    why: str


class Excludes(NamedTuple):
    """What is left out of a model's contacts."""

    rows: tuple[Excluded, ...]
    geoms: frozenset[tuple[int, int]]
    """Pairs `(i, j)` of geom ids, i < j."""


def find_excludes(
    model: mujoco.MjModel,
    bodies: tuple[str, ...],
    motion: Moving,
    apart: Iterable[int],
    exclude: Exclude,
) -> Excludes:
    """What is left out.

    Args:
        model: The model.
        bodies: Names by id.
        motion: What moves.
        apart: Bodies that queries place: objects, and that of the slots.
        exclude: See `Scene.from_mjcf`.

    Raises:
        ValueError: There is no such body, or a word means nothing here.
    """
    entries = [exclude] if isinstance(exclude, str) else list(exclude or ())
    rows, geoms = [], set()
    given = dict.fromkeys(_two_bodies(e, bodies) for e in entries if e != ALWAYS)
    for names in given:
        rows.append(Excluded(*names, "given"))
        a, b = (bodies.index(name) for name in names)
        geoms |= {tuple(sorted(pair)) for pair in product(*_geoms(model, a, b))}
    if ALWAYS in entries:
        found = touching_pairs(model, motion, apart)
        for pair, share in found.items():
            if pair not in geoms:
                why = f"touch in {100 * share:.3g} % of random poses"
                i, j = (geom_name(model, bodies, geom) for geom in pair)
                rows.append(Excluded(i, j, why))
        geoms |= set(found)
    return Excludes(tuple(rows), frozenset(geoms))


def _two_bodies(entry: str | Sequence[str], bodies: tuple[str, ...]) -> tuple[str, str]:
    """The bodies of a pair."""
    parts = entry.split("|") if isinstance(entry, str) else entry
    if isinstance(entry, str) and len(parts) > 2:
        return pair_of(entry, bodies, ())  # bodies with | in their names
    if len(parts) != 2:
        raise ValueError(
            f"exclude {entry!r}: say {ALWAYS!r}, 'body|body' or ('body', 'body')"
        )
    return pair_of((parts[0], parts[1]), bodies, ())


def _geoms(model: mujoco.MjModel, *bodies: int) -> list[range]:
    """Ids of the geoms of each body."""
    first, count = model.body_geomadr, model.body_geomnum
    return [range(first[b], first[b] + count[b]) for b in bodies]

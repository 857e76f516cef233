"""Which geoms are checked together: read once from the scene's contacts.

What has a closed form becomes fronts, many geoms against the same obstacles; the other
pairs go one by one to the search for convex geoms.
"""

from collections import defaultdict
from typing import NamedTuple

from jaxplan.collision.margins import Rule, pair_rules
from jaxplan.collision.narrow import CLOSED
from jaxplan.scene import Geoms, Scene, geom_pairs


class Front(NamedTuple):
    """Geoms of several bodies that face the same obstacles, all of one body."""

    facing: tuple[int, ...]
    """Geom ids."""
    links: tuple[int, ...]
    """Kinematic link of each."""
    groups: tuple[int, ...]
    """Contact group of each."""
    rules: tuple[tuple[Rule, ...], ...]
    """By obstacle: what each asks for."""
    obstacles: tuple[Geoms, ...]
    kinds: tuple[str, str]


class ConvexPairs(NamedTuple):
    """Pairs of geoms whose distance has no closed form."""

    geoms: dict[tuple[str, bool], tuple[int, ...]]
    """Their ids, by kind and whether they are in slots."""
    pairs: tuple[tuple[int, int], ...]
    """Geom ids."""
    groups: tuple[int, ...]
    """Contact group of each pair."""
    rules: tuple[Rule, ...]
    """What each pair asks for."""


def find_fronts(scene: Scene) -> list[Front]:
    """Contacts in closed form, put together by obstacle and by who faces it, slots apart."""
    facing = defaultdict(list)
    slots, rules = {slot.geom for slot in scene.slots}, pair_rules(scene)
    for index, group in enumerate(scene.groups):
        for contact in group.contacts:
            if (contact.a.kind, contact.b.kind) not in CLOSED:
                continue
            moves = contact.a.ids[0] in slots
            facing[contact.b, contact.a.kind, moves].append((contact.a, index))
    together = defaultdict(list)
    for (obstacle, kind, _), sides in facing.items():
        key = tuple(sides), obstacle.body, (kind, obstacle.kind)
        together[key].append(obstacle)
    fronts = []
    for (sides, _, kinds), obstacles in together.items():
        rows = [(g, s.body, index) for s, index in sides for g in s.ids]
        geoms, bodies, groups = zip(*rows, strict=True)
        links = tuple(scene.structure.link_of[body] for body in bodies)
        asked = tuple(
            tuple(rules[geom, obstacle] for geom in geoms)
            for o in obstacles
            for obstacle in o.ids
        )
        fronts.append(Front(geoms, links, groups, asked, tuple(obstacles), kinds))
    return fronts


def find_convex_pairs(scene: Scene) -> ConvexPairs:
    """The other contacts, pair by pair."""
    slots, rules = {slot.geom for slot in scene.slots}, pair_rules(scene)
    geoms: dict[tuple[str, bool], dict[int, None]] = defaultdict(dict)
    pairs: list[tuple[int, int]] = []
    groups: list[int] = []
    for index, group in enumerate(scene.groups):
        for contact in group.contacts:
            if (contact.a.kind, contact.b.kind) in CLOSED:
                continue
            for side in (contact.a, contact.b):
                for geom in side.ids:
                    geoms[side.kind, geom in slots][geom] = None
            own = geom_pairs(contact)
            pairs += own
            groups += [index] * len(own)
    return ConvexPairs(
        {key: tuple(ids) for key, ids in geoms.items()},
        tuple(pairs),
        tuple(groups),
        tuple(rules[pair] for pair in pairs),
    )

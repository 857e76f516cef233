"""The variant `ways`: an obstacle on the way to the box that can be passed on either side.

Where every demonstration takes the same way, a sampler that holds one way is as good as one that
holds many. Here a post stands between the place where the mug is put upright and the box, which
is farther off than in the other variants. The mug is carried past it inside (between post and
robot) or outside, on ways of about the same length:

             outside
                |
    staging   post   box
                |
              inside
                |
              robot

In some episodes one of them is closed by a zone that hand and mug must keep out of, as the tool
zones of an arm's safety controller are. The planner knows of it; no camera sees it, so that no
network can tell. So a demonstration's way is its seed's, not the shorter one, and a sampler that
proposes one way only, or the mean of two, pays for it in the episodes where that one is closed.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from jaxplan.tasks.mug.clutter import CLUTTERED
from jaxplan.tasks.mug.variant import Slab, Variant

STREAM = 5
"""Of random numbers, beside those that the episode itself takes from its seed."""
OPEN = 0.2
"""Share of episodes in which no way is closed."""
NEAR, FAR = -0.193, -0.177
"""The post's faces across the way [m]."""
INSIDE, OUTSIDE = 0.485, 0.515
"""Those along it."""
HIGH = 1.2
"""Of zones: hand and mug do not pass above them either [m]."""

WAYS = Variant(
    obstacles=(Slab("post", low=(INSIDE, NEAR, 0.0), high=(OUTSIDE, FAR, 0.50)),),
    box=(0.45, -0.44, 0.0),
    zones={
        "inside": Slab("inside", (INSIDE - 0.7, NEAR, 0.0), (INSIDE, FAR, HIGH)),
        "outside": Slab("outside", (OUTSIDE, NEAR, 0.0), (OUTSIDE + 0.5, FAR, HIGH)),
    },
    # Beside the post there is little room: trees in balance, that do not reach for what is hidden.
    search=replace(
        CLUTTERED.search, max_expansions=6000, balance=True, dynamic_domain=3.0
    ),
)


def closed_way(seed: int, ways: Iterable[str]) -> str | None:
    """Which of some ways is closed in an episode; None where there is none, or all are open."""
    names = tuple(ways)
    rng = np.random.default_rng([seed, STREAM])
    if not names or rng.random() < OPEN:
        return None
    return names[rng.integers(len(names))]


def way_of(places: np.ndarray) -> str | None:
    """By which way a hand passes the post; None if it does not.

    Args:
        places: `[T, 3]` of the tool centre point [m].
    """
    middle = (NEAR + FAR) / 2
    across = np.flatnonzero(np.diff(places[:, 1] < middle))
    if not len(across):
        return None
    return "inside" if places[across[-1], 0] < (INSIDE + OUTSIDE) / 2 else "outside"

"""What a planning method is: a machine with discrete control, told by seven functions.

From its control a worker proposes one move; the verdict on that move gives its next control.
A new method is a file that ends in a `Method`, and a line in `methods.METHODS`.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax

from jaxplan.config import PlannerConfig
from jaxplan.planning.proposal import Draw
from jaxplan.planning.segment import Segment
from jaxplan.planning.space import Space
from jaxplan.planning.state import Control, Move, Outcome, Problem
from jaxplan.planning.tree import Tree


class Method(NamedTuple):
    """P problems, K workers each."""

    roots: Callable[[Problem], jax.Array]
    """`[P, trees, d]` where trees start."""
    begin: Callable[[Problem, Space, PlannerConfig], Control]
    """The workers' first control."""
    asks: Callable[[Control, Draw, PlannerConfig], jax.Array]
    """`[P, K]` whether the next move needs a learned segment."""
    propose: Callable[[Control, Draw, jax.Array, Segment, Problem, PlannerConfig], Move]
    """(control, draw, `[P, K]` who got a segment, these, problems, config) -> moves."""
    advance: Callable[[Control, Outcome, Problem, Tree, Space, PlannerConfig], Control]
    """What follows an accepted or a rejected move."""
    ends: Callable[[Tree, Control, Problem, Space], tuple[jax.Array, jax.Array]]
    """`[P]` each: the last node of the path, and the node of a second tree that goes on, or -1."""
    optimises: bool = False
    """The search goes on after the first path, for shorter ones."""
    goal_sets: bool = False
    """Several goals may be asked for at once."""

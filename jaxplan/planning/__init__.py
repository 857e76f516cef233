"""Batched RRT and RRT-Connect with learned segments (Algorithm 1) on fixed arrays."""

from jaxplan.planning.plan import make_planner
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.search import finish, grow, start
from jaxplan.planning.segment import Proposal, Segment
from jaxplan.planning.state import State, searching
from jaxplan.planning.tree import Tree

__all__ = [
    "PlanResult",
    "Proposal",
    "Segment",
    "State",
    "Status",
    "Tree",
    "finish",
    "grow",
    "make_planner",
    "searching",
    "start",
]

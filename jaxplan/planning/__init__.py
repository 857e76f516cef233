"""Batched RRT and RRT-Connect with learned segments (Algorithm 1) on fixed arrays."""

from jaxplan.planning.edges import points_for
from jaxplan.planning.plan import make_planner
from jaxplan.planning.result import PlanResult, Status
from jaxplan.planning.segment import DrawBank, Proposal, Segment
from jaxplan.planning.tree import Tree

__all__ = [
    "DrawBank",
    "PlanResult",
    "Proposal",
    "Segment",
    "Status",
    "Tree",
    "make_planner",
    "points_for",
]

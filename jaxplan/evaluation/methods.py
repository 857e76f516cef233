"""The methods of the paper's Table 2, and the backbones in which they are compared.

Within a backbone all rows have the same steps, step lengths, goal tests and budget: they
differ in where proposals come from, and in nothing else.
"""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from jaxplan.config import PAPER_PLANNER, PlannerConfig


class TableRow(NamedTuple):
    """A row of Table 2."""

    name: str
    weights: str | None = None
    """Of the learned sampler (`load_weights`); None = uniform proposals."""
    changes: Mapping[str, Any] = MappingProxyType({})
    """To the backbone's settings."""
    paper: float | None = None
    """Expansions normalised to ours, Table 2."""


class Backbone(NamedTuple):
    """An RRT for all rows."""

    name: str
    planner: dict[str, Any]
    note: str
    trials: int | None = None
    """The first so many; None = all."""


OURS = "ours (diffusion, DDIM-25)"
METHODS = (
    TableRow(OURS, "sampler", paper=1.0),
    TableRow("ours without tree context", "sampler", {"tree_context": False}),
    TableRow("few-step", "few_step"),
    TableRow("CVAE", "cvae", paper=1.36),
    TableRow("conditional GAN", "gan", paper=1.67),
    TableRow("uniform, no goal bias", None, {"goal_bias": 0.0}, 2.75),
    TableRow("uniform, 5 % goal bias", None, {"goal_bias": 0.05}, 2.75),
    TableRow("uniform, greedy", None, {"goal_bias": 0.05, "greedy": True}),
    TableRow("goal-biased 0.5", None, {"goal_bias": 0.5}, 1.73),
    TableRow("goal-biased 0.8", None, {"goal_bias": 0.8}),
)
BACKBONES = (
    Backbone(
        "rrt_connect",
        {"method": "rrt_connect"},
        "RRT-Connect. The first thing that every row tries is the straight motion.",
    ),
    Backbone(
        "rrt",
        {"method": "rrt"},
        "One tree. A node within 0.3 rad of the goal tries the straight motion there, "
        "in every row.",
    ),
    Backbone(
        "literal",
        {
            "method": "rrt",
            "goal_connect": 0.0,
            "goal_bias": 0.0,
            "uniform_mode": "independent",
            "tree_context": False,
        },
        "Algorithm 1 to the letter: one tree, no straight motion to the goal, uniform "
        "segments whose direction is independent of the sample, learned ones taken from the "
        "node nearest to the goal, wherever they were meant to begin. 100 trials.",
        100,
    ),
)


def planner(backbone: Backbone, method: TableRow, **changes: Any) -> PlannerConfig:
    """Settings of a method in a backbone; without a sampler all proposals are uniform."""
    settings = dict(backbone.planner)
    if method.weights is None:
        # A classical baseline steers toward its sample: the letter's uniform segments
        # are part of the mixture.
        settings |= {"p_uniform": 1.0, "uniform_mode": "toward"}
    settings |= method.changes
    return dataclasses.replace(PAPER_PLANNER, **(settings | changes))

"""Settings of planning, and of what follows it, as frozen dataclasses.

The defaults are for planning as such; `PAPER_PLANNER` has the paper's numbers. What belongs to
a network, a training, an agent or a task stands beside it. A file in `configs/` holds
differences from the defaults and nothing else.
"""

import types
import typing
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

from jaxplan.ranges import (
    Checked,
    Count,
    NotNegative,
    Positive,
    Probability,
    Share,
    Step,
    StepOrOff,
    Whole,
)


@dataclass(frozen=True)
class PlannerConfig(Checked):
    """RRT and RRT-Connect (Algorithm 1). Switches apply to every sampler alike.

    The defaults are for planning as such; `PAPER_PLANNER` has the paper's numbers.
    """

    method: str = "rrt_connect"
    """`rrt`, `rrt_connect`, or `ao_rrt_connect`, which uses all of `max_expansions` to find ever
    shorter paths (`planning.methods`)."""
    max_expansions: Count = 50_000
    """N_rrt: proposals whose motion is checked, each connect step included."""
    p_uniform: Probability = 0.5
    """Probability that a proposal is a uniform segment and not a learned one, if there is a
    sampler."""
    tree_context: bool = True
    """A learned segment that says where it begins is taken from the node nearest to its end,
    straight at that end, and followed there. Off: from the node nearest to q_goal, along its
    direction, as in Algorithm 1."""
    greedy: bool = False
    """Samples of a uniform or goal-biased proposal are followed too, and not stepped toward once;
    in RRT-Connect this is RRT-ConCon."""
    uniform_mode: Literal["toward", "independent"] = "toward"
    """`toward`: the uniform move goes from the nearest node toward q_rand (classical RRT).
    `independent`: its direction is drawn apart from q_rand, as the paper's UniformSegment."""
    goal_bias: Probability = 0.05
    """Probability that a uniform proposal goes straight toward q_goal."""
    step_min: Positive = 1.0
    step_max: Positive = 1.0
    """Step length of every sampler, s in `[step_min, step_max]` [rad]."""
    goal_tolerance: NotNegative = 0.05
    """A node reaches q_goal within this distance [rad]."""
    goal_connect: NotNegative = 0.3
    """An accepted node this near to q_goal [rad] tries the straight motion there; 0 = off."""
    goal_tree: Literal["mirrored", "uniform"] = "mirrored"
    """RRT-Connect's second tree: learned segments reversed, or uniform ones only."""
    toggle_tie_break: NotNegative = 0.0
    """Nodes whose distances to the target differ by less than this [rad] count as tied, and the
    one nearer to q_toggle is the base of a learned proposal (section 4.3); 0 = off."""
    balance: bool = True
    """RRT-Connect's smaller tree grows until it has half of the other's nodes; off: in turn."""
    dynamic_domain: NotNegative = 3.0
    """Of a node whose motion was blocked: farther samples than this [rad] do not come to it, see
    `planning.domain`; 0 = off."""
    metric: tuple[Positive, ...] | None = None
    """Diagonal of W in d(q, q') = |W (q - q')|; None = identity."""
    workers: Count = 16
    """K: expansions of a problem in one round, which do not know of each other. 1 is the textbook
    algorithm; more find a way sooner."""
    lanes: Count = 32
    """Problems of a batch that are searched side by side; the others wait for a free lane."""
    check_rows: Count = 256
    """Configurations of one collision call, about. More pays on a GPU; the trees are the same."""
    margin: NotNegative = 0.0
    """Clearance that a configuration needs to count as free [m]; 0 = C MuJoCo's own verdict."""
    edge_resolution: Step = 1 / 32
    """Longest gap between checked configurations of a motion [rad]."""
    path_resolution: StepOrOff = 0.01
    """The same on the path that is found, checked once more as a whole; 0 = off."""


PAPER_PLANNER = PlannerConfig(
    max_expansions=500,
    p_uniform=0.2,
    step_min=0.05,
    step_max=0.2,
    balance=False,
    dynamic_domain=0.0,
    workers=1,
    margin=0.004,  # covers tracking errors
    edge_resolution=0.025,
    path_resolution=0.0,  # what is executed is validated after smoothing
)
"""Section 5.1, and one proposal at a time."""


@dataclass(frozen=True)
class TrajectoryConfig(Checked):
    """Shortcut, B-spline, time parameterisation and dense validation (section 4.3)."""

    shortcut_rounds: Whole = 8
    shortcut_candidates: Count = 32
    spline_step: Step = 0.1
    """Longest knot spacing of the spline [rad]."""
    check_resolution: Step = 0.01
    """Longest gap between checked configurations where nothing proves what lies between [rad]."""
    check_rows: Count = 1024
    """Configurations of one collision call."""
    velocity_scale: Share = 1.0
    acceleration_scale: Share = 1.0
    """Shares of the joint velocity and acceleration limits that are used."""
    control_period: Step = 0.01
    """Sampling period of the timed trajectory [s]."""


EXECUTED_TRAJECTORY = TrajectoryConfig(velocity_scale=0.6, acceleration_scale=0.4)
"""What an arm does in physics: its controller follows no motion at its very limits."""


def from_dict(kind: type, values: Any) -> Any:
    """Rebuilds a config of class `kind` from `dataclasses.asdict`, also by way of JSON.

    Raises:
        ValueError: A key that `kind` does not have.
    """
    if isinstance(kind, types.UnionType):
        kinds = [k for k in typing.get_args(kind) if k is not type(None)]
        return None if values is None else from_dict(kinds[0], values)
    if is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        known = {field.name for field in fields(kind)}
        if unknown := sorted(set(values) - known):
            raise ValueError(f"{kind.__name__} has no {', '.join(unknown)}")
        return kind(**{name: from_dict(hints[name], v) for name, v in values.items()})
    return tuple(values) if isinstance(values, list) else values

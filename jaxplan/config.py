"""Every setting, as frozen dataclasses. Defaults are the paper's numbers where it gives them.

A file in `configs/` holds differences from these defaults and nothing else.
"""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class PlannerConfig:
    """RRT and RRT-Connect (Algorithm 1). Switches apply to every sampler alike."""

    method: Literal["rrt", "rrt_connect"] = "rrt_connect"
    max_expansions: int = 500
    """N_rrt: proposals whose motion is checked, each connect step included."""
    p_uniform: float = 0.2
    """Probability that a proposal is a uniform segment and not a learned one."""
    uniform_mode: Literal["toward", "independent"] = "toward"
    """`toward`: the uniform move goes from the nearest node toward q_rand (classical RRT).
    `independent`: its direction is drawn apart from q_rand, as the paper's UniformSegment."""
    goal_bias: float = 0.05
    """Probability that a uniform proposal goes straight toward q_goal."""
    step_min: float = 0.05
    step_max: float = 0.2
    """Step length of every sampler, s in [step_min, step_max] [rad]."""
    goal_tolerance: float = 0.05
    """A node reaches q_goal within this distance [rad]."""
    goal_connect: float = 0.3
    """An accepted node nearer to q_goal than this tries the straight motion there [rad]; 0 = off."""
    toggle_tie_break: float = 0.0
    """Nodes whose distances to the target differ by less than this [rad] count as tied, and the
    one nearer to q_toggle is the base of a learned proposal (section 4.3); 0 = off."""
    metric: tuple[float, ...] | None = None
    """Diagonal of W in d(q, q') = |W (q - q')|; None = identity."""
    proposals: int = 16
    """Proposals checked in one call. Any value gives the tree that 1 gives."""
    edge_resolution: float = 0.025
    """Longest gap between checked configurations of a motion [rad]."""


@dataclass(frozen=True)
class TrajectoryConfig:
    """Shortcut, B-spline, time parameterisation and dense validation (section 4.3)."""

    shortcut_rounds: int = 8
    shortcut_candidates: int = 32
    spline_step: float = 0.1
    """Longest distance between spline interpolation points [rad]."""
    check_resolution: float = 0.02
    """Gap of the dense validation [rad]."""
    velocity_scale: float = 0.6
    acceleration_scale: float = 0.4
    """Shares of the joint velocity and acceleration limits that are used."""
    control_period: float = 0.01
    """Sampling period of the timed trajectory [s]."""

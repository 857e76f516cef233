"""Settings that make sense each, and together do not.

Each one's own range is its type in `PlannerConfig`, checked when that is made.
"""

from jaxplan.config import PlannerConfig
from jaxplan.planning.edges import points_for
from jaxplan.planning.methods import method_of

MOST_POINTS = 2**20
"""Checked configurations of a motion at most."""


def check_settings(config: PlannerConfig, joints: int) -> None:
    """Refuses settings under which the search would be wrong without a word.

    Args:
        config: Of the search.
        joints: How many are planned for.

    Raises:
        ValueError: What does not fit together.
    """
    if not isinstance(config, PlannerConfig):
        raise ValueError(f"config is a {type(config).__name__}, not a PlannerConfig")
    if config.step_min > config.step_max:
        steps = f"{config.step_min}, {config.step_max}"
        raise ValueError(f"step_min, step_max {steps}, expected min <= max")
    if points_for(config.step_max, config.edge_resolution) > MOST_POINTS:
        raise ValueError(
            f"edge_resolution {config.edge_resolution}, expected at least a 2^20th of "
            f"step_max {config.step_max}"
        )
    if config.metric is not None and len(config.metric) != joints:
        raise ValueError(f"metric {config.metric}, expected {joints} weights")
    if method_of(config).optimises:
        if config.toggle_tie_break > 0 or config.metric is not None:
            raise ValueError("ao_rrt_connect has no toggle_tie_break and no metric")
        if config.uniform_mode != "toward":
            raise ValueError("ao_rrt_connect needs uniform_mode 'toward'")

"""The registry of planning methods."""

from jaxplan.config import PlannerConfig
from jaxplan.planning.method import Method
from jaxplan.planning.rrt import RRT
from jaxplan.planning.rrt_connect import AO_RRT_CONNECT, RRT_CONNECT

METHODS: dict[str, Method] = {
    "rrt": RRT,
    "rrt_connect": RRT_CONNECT,
    "ao_rrt_connect": AO_RRT_CONNECT,
}


def method_of(config: PlannerConfig) -> Method:
    """The method that the settings name.

    Raises:
        ValueError: There is none of that name.
    """
    if config.method not in METHODS:
        raise ValueError(f"method {config.method!r}, expected {', '.join(METHODS)}")
    return METHODS[config.method]

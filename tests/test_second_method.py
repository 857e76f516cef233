"""A second planning method: RRT without a goal connection, as an entry of the registry."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxplan.config import PlannerConfig
from jaxplan.planning import Status, make_planner
from jaxplan.planning.methods import METHODS
from jaxplan.planning.rrt import RRT


def begin(problems, space, config):
    """Nobody tries the straight motion first."""
    control = RRT.begin(problems, space, config)
    nobody = jnp.zeros_like(control.connecting)
    return control._replace(connecting=nobody, chained=nobody)


def search(method):
    config = PlannerConfig(
        method=method, max_expansions=4000, step_max=0.2, step_min=0.2, goal_connect=0.2
    )
    plan = make_planner(
        lambda worlds, problem, q: jnp.linalg.norm(q, axis=-1) > 0.5,
        config,
        [-2, -2],
        [2, 2],
    )
    key = jax.random.key(0)[None]
    return plan(np.zeros(1), [[-1, 0]], [[1, 0.5]], [[1, 0.5]], key)


def test_it_plans(monkeypatch):
    monkeypatch.setitem(METHODS, "patient", RRT._replace(begin=begin))
    found, rrt = search("patient"), search("rrt")
    assert found.status[0] == rrt.status[0] == Status.SOLVED
    path = found.path[0, : found.path_length[0]]
    assert np.all(np.linalg.norm(path, axis=1) > 0.5)


def test_an_unknown_method_is_refused():
    with pytest.raises(ValueError, match="method 'patient', expected rrt, rrt_connect"):
        search("patient")

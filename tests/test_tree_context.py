"""Segments that say where they begin: the choice among them, and what it is good for."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from planning_spheres import Spheres, config_free

from jaxplan.config import PAPER_PLANNER
from jaxplan.planning import Segment, Status, make_planner
from jaxplan.planning.tree_context import fitting

CORNER = np.array([1.0, 0.0], np.float32)
"""The way from (0, 0) to (1, 1) leads past it; a sphere is on the diagonal."""


def along_the_corner(problems: int, rows: int) -> Segment:
    """Segments of the way around, in random order, with the bases they are meant for."""
    arc = jax.random.uniform(jax.random.key(0), (problems, rows), maxval=1.85)
    first = arc < 1
    base = jnp.stack([jnp.minimum(arc, 1), jnp.maximum(arc - 1, 0)], axis=-1)
    direction = jnp.where(first[..., None], jnp.eye(2)[0], jnp.eye(2)[1])
    return Segment(direction, jnp.full(arc.shape, 0.15), base)


def test_the_nearest_of_some_is_taken():
    bank = along_the_corner(2, 64)
    expansion = jnp.tile(jnp.arange(50), (2, 1))
    q_base = jnp.broadcast_to(jnp.array([0.5, 0.0]), (2, 50, 2))
    keys = jax.random.split(jax.random.key(1), 2)
    forward = jnp.zeros((2, 50), bool)
    row = fitting(bank, q_base, forward, keys, expansion)
    begins = np.take_along_axis(bank.base, row[..., None], axis=1)
    assert np.linalg.norm(begins - q_base, axis=-1).mean() < 0.1
    assert len(np.unique(row)) > 5, "always the same one"
    np.testing.assert_array_equal(
        row[1:], fitting(bank, q_base, forward, keys, expansion)[1:]
    )
    row = fitting(bank, q_base, ~forward, keys, expansion)
    ends = bank.base + bank.length[..., None] * bank.direction
    ends = np.take_along_axis(ends, row[..., None], axis=1)
    assert np.linalg.norm(ends - q_base, axis=-1).mean() < 0.1


def test_no_number_is_no_base():
    bank = along_the_corner(1, 8)
    bank = bank._replace(base=bank.base.at[:, :7].set(jnp.nan))
    keys, expansion = jax.random.split(jax.random.key(1), 1), jnp.arange(40)[None]
    row = fitting(
        bank, jnp.zeros((1, 40, 2)), jnp.zeros((1, 40), bool), keys, expansion
    )
    assert np.mean(np.asarray(row) == 7) > 0.15


def test_a_bent_way_takes_fewer_expansions_with_bases():
    """Around a corner, segments of the first half do not help in the second."""
    count = 32
    worlds = Spheres(
        np.tile(np.array([0.4, 0.6], np.float32), (count, 1, 1)),
        np.full((count, 1), 0.5, np.float32),
    )
    q_start, q_goal = np.zeros((count, 2), np.float32), np.ones((count, 2), np.float32)
    keys = jax.random.split(jax.random.key(2), count)
    limit = np.full(2, 3.0)
    bank = along_the_corner(count, 32)
    for method in ("rrt", "rrt_connect"):
        config = replace(PAPER_PLANNER, method=method, goal_bias=0.0)
        plan = make_planner(config_free, config, -limit, limit)
        args = worlds, q_start, q_goal, q_goal, keys
        blind, told = (
            plan(*args, lambda chunk, bank=bank: bank)
            for bank in (bank._replace(base=None), bank)
        )
        # A node that strayed behind the sphere is nearest to the goal, and no way on.
        assert np.mean(told.status == Status.SOLVED) > 0.85
        medians = np.median(told.expansions), np.median(blind.expansions)
        assert medians[0] < 0.8 * medians[1], (method, medians)

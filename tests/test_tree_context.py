"""Segments that say where they begin (TreeContext): how they are followed, and to what good."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from planning_spheres import Spheres, config_free
from quick import jit

from jaxplan.config import PAPER_PLANNER
from jaxplan.planning import Segment, Status, make_planner

CORNER = np.array([1.0, 0.0], np.float32)
"""The way from (0, 0) to (1, 1) leads past it; a sphere is on the diagonal."""
LIMIT = np.full(2, 3.0)


def along_the_corner(problems: int, rows: int) -> Segment:
    """Segments of the way around, in random order, with the bases they are meant for."""
    arc = jax.random.uniform(jax.random.key(0), (problems, rows), maxval=1.85)
    first = arc < 1
    base = jnp.stack([jnp.minimum(arc, 1), jnp.maximum(arc - 1, 0)], axis=-1)
    direction = jnp.where(first[..., None], jnp.eye(2)[0], jnp.eye(2)[1])
    return Segment(direction, jnp.full(arc.shape, 0.15), base)


def corner(count):
    """Arguments of a planner for `count` problems with a sphere on the diagonal."""
    worlds = Spheres(
        np.tile(np.array([0.4, 0.6], np.float32), (count, 1, 1)),
        np.full((count, 1), 0.5, np.float32),
    )
    q_start, q_goal = np.zeros((count, 2), np.float32), np.ones((count, 2), np.float32)
    return worlds, q_start, q_goal, q_goal, jax.random.split(jax.random.key(2), count)


def planner(**settings):
    config = replace(PAPER_PLANNER, goal_bias=0.0, **settings)
    return make_planner(config_free, config, -LIMIT, LIMIT, jit)


@pytest.mark.parametrize("method", ["rrt", "rrt_connect"])
def test_no_number_is_no_base(method):
    """Segments whose bases are not numbers leave the uniform search, to the last bit."""
    bank = along_the_corner(8, 32)
    bank = bank._replace(base=bank.base.at[..., 0].set(jnp.nan))
    plan = planner(method=method)
    broken = plan(*corner(8), lambda bank_number: bank)
    uniform = plan(*corner(8))
    np.testing.assert_array_equal(broken.path, uniform.path)
    np.testing.assert_array_equal(broken.expansions, uniform.expansions)


@pytest.mark.parametrize("method", ["rrt", "rrt_connect"])
def test_switched_off_bases_do_not_count(method):
    bank = along_the_corner(8, 32)
    plan = planner(method=method, tree_context=False)
    told, blind = (
        plan(*corner(8), lambda bank_number, bank=bank: bank)
        for bank in (bank, bank._replace(base=None))
    )
    np.testing.assert_array_equal(told.path, blind.path)


def test_the_way_back_ends_where_the_segment_begins():
    segment = along_the_corner(2, 5)
    back = segment._replace(direction=3 * segment.direction).reversed()
    np.testing.assert_allclose(back.base, segment.end, atol=1e-6)
    np.testing.assert_allclose(back.end, segment.base, atol=1e-6)


@pytest.mark.parametrize("method", ["rrt", "rrt_connect"])
def test_a_bent_way_takes_fewer_expansions_with_bases(method):
    """Around a corner, segments of the first half do not help in the second."""
    bank = along_the_corner(32, 32)
    told, blind = (
        planner(method=method, tree_context=on)(*corner(32), lambda bank_number: bank)
        for on in (True, False)
    )
    # A node that strayed behind the sphere is nearest to the goal, and no way on.
    assert np.mean(told.status == Status.SOLVED) > 0.95
    medians = np.median(told.expansions), np.median(blind.expansions)
    assert medians[0] < 0.5 * medians[1], medians

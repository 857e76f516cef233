"""Which ways proposals cover, against what can be seen by eye."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxplan.evaluation.coverage import coverage, to_path

LEFT = np.array([[0.0, 0], [-1, 1], [-1, 3], [0, 4]])
RIGHT = LEFT * [-1, 1]


def cloud(centre, count, seed=0):
    return np.array(centre) + np.random.default_rng(seed).normal(0, 0.05, (count, 2))


def lost(ends):
    """Zones across either way at a height of 1.5 to 2.5."""
    across = np.abs(ends[:, 1] - 2) < 0.5
    return np.stack([across & (ends[:, 0] < -0.5), across & (ends[:, 0] > 0.5)], axis=1)


@pytest.mark.parametrize("left", [0, 1, 4, 6, 50, 94, 96, 100])
def test_shares_are_counted_by_way(left):
    ends = np.concatenate([cloud([-1, 2], left), cloud([1, 2], 100 - left)])
    found = coverage(lost(ends), ends, [LEFT, RIGHT])
    np.testing.assert_allclose(found.shares, [left / 100, 1 - left / 100])
    np.testing.assert_array_equal(found.covered, [left >= 5, left <= 95])
    assert found.distance < 0.1


def test_where_ways_are_one_a_proposal_belongs_to_none():
    ends = cloud([0, 0], 50)
    assert coverage(lost(ends), ends, [LEFT, RIGHT]).shares.sum() == 0
    middle = cloud([0, 2], 50)
    found = coverage(lost(middle), middle, [LEFT, RIGHT])
    assert found.shares.sum() == 0
    assert found.distance > 0.9


def test_what_is_lost_with_either_way_belongs_to_none():
    both = np.ones((10, 2), bool)
    assert coverage(both, cloud([0, 2], 10), [LEFT, RIGHT]).shares.sum() == 0


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000))
def test_the_distance_to_a_polyline_is_that_to_its_dense_points(seed):
    rng = np.random.default_rng(seed)
    path, q = rng.normal(size=(4, 3)), rng.normal(size=(5, 3))
    share = np.linspace(0, 1, 2001)[:, None]
    dense = np.concatenate([a + share * (b - a) for a, b in pairwise(path)])
    brute = np.linalg.norm(q[:, None] - dense, axis=2).min(axis=1)
    np.testing.assert_allclose(to_path(q, path), brute, atol=2e-3)

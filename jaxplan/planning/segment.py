"""A tree-extension segment: which way, and how far."""

from typing import NamedTuple

import jax


class Segment(NamedTuple):
    """Unit direction u and step length s (section 3.3); leading axes are batches."""

    direction: jax.Array
    """[..., d], |u| = 1."""
    length: jax.Array
    """[...] [rad]."""

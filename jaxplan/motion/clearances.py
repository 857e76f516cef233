"""Clearances of any shape of configurations, in worlds of any."""

from functools import partial

import numpy as np

from jaxplan.collision import World
from jaxplan.motion import checks
from jaxplan.motion.blocks import in_blocks
from jaxplan.motion.search import Search


def clearances(search: Search, world: World, empty: World, q: np.ndarray) -> np.ndarray:
    """`[...]` [m] of `q [..., d]`; leading axes of the world broadcast against those of q.

    Args:
        search: Of the scene.
        world: Checked for what is in it only.
        empty: The scene's own, for the shapes.
        q: Checked.

    Raises:
        ValueError: The world is none of this scene, or its axes do not fit.
    """
    batch = checks.batch_of(world, empty, q.shape[:-1])
    world = checks.world_of(world, empty, batch)
    rows = np.broadcast_to(q, (*batch, q.shape[-1])).reshape(-1, q.shape[-1])
    if world.passive.ndim == empty.passive.ndim:  # one for all
        found = in_blocks(partial(search.clearance, world), rows)
    else:
        leaves = zip(world, empty, strict=True)
        each = World(*(leaf.reshape(len(rows), *own.shape) for leaf, own in leaves))
        found = in_blocks(search.clearance, each, rows)
    return found.reshape(batch)

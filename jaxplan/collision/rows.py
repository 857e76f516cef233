"""Our own distance for any number of configurations, compiled once."""

from functools import partial

import jax
import numpy as np

from jaxplan.collision.engine import BLOCK, XLA_OPTIONS
from jaxplan.collision.queries import clearance
from jaxplan.collision.world import World
from jaxplan.scene import Scene


def clearance_rows(scene: Scene, world: World, rows: np.ndarray) -> np.ndarray:
    """`clearance` [m], `[n]`, of configurations `[n, d]` in one world.

    Blocks of a fixed number of rows, so that nothing compiles anew for another number.
    """
    found = []
    for start in range(0, len(rows), BLOCK):
        block = np.asarray(rows[start : start + BLOCK], np.float32)
        padded = np.pad(block, ((0, BLOCK - len(block)), (0, 0)), mode="edge")
        found.append(np.asarray(_block(scene, world, padded))[: len(block)])
    return np.concatenate(found) if found else np.zeros(0)


@partial(jax.jit, compiler_options=XLA_OPTIONS)
def _block(scene: Scene, world: World, q: jax.Array) -> jax.Array:
    return clearance(scene, world, q)

"""Our own distance for any number of configurations, compiled once."""

import jax
import numpy as np

from jaxplan.collision.engine import BLOCK
from jaxplan.collision.programs import per_scene
from jaxplan.collision.queries import clearance
from jaxplan.collision.world import World
from jaxplan.scene import Scene


def clearance_rows(
    scene: Scene, world: World, rows: np.ndarray, motion: np.ndarray | None = None
) -> np.ndarray:
    """`clearance` [m], `[n]`, of configurations `[n, d]` in one world.

    Blocks of a fixed number of rows, so that nothing compiles anew for another number.

    Args:
        scene: The scene.
        world: One world.
        rows: `[n, d]` joints.
        motion: `[n, d]`, see `clearance`.
    """

    def block(leaf: np.ndarray, start: int) -> np.ndarray:
        part = np.asarray(leaf[start : start + BLOCK], np.float32)
        return np.pad(part, ((0, BLOCK - len(part)), (0, 0)), mode="edge")

    given = [rows] if motion is None else [rows, motion]
    found = [
        np.asarray(_block(scene, world, *(block(leaf, start) for leaf in given)))
        for start in range(0, len(rows), BLOCK)
    ]
    return np.concatenate([*found, []])[: len(rows)]


@per_scene
def _block(
    scene: Scene, world: World, q: jax.Array, motion: jax.Array | None = None
) -> jax.Array:
    return clearance(scene, world, q, motion=motion)

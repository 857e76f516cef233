"""Which contacts that are checked are there wherever the arm is."""

from collections import Counter

import numpy as np

from jaxplan.collision.oracle import contacts_of
from jaxplan.collision.world import make_world
from jaxplan.ranges import Count, NotNegative, check
from jaxplan.scene import Scene

OFTEN = 0.9
"""Share of poses from which on a contact is taken for one that is always there."""


def always_touching(
    scene: Scene, samples: int = 200, tolerance: float = 1e-4
) -> list[tuple[str, float]]:
    """Contact groups that nearly no pose is free of, by C MuJoCo.

    What is safe to leave out by default is not among them (`exclude` of `Scene.from_mjcf`);
    what is left may be excluded, or ignored (`make_world`), by who knows the robot.

    Args:
        scene: Its slots stay empty, its objects and passive joints at their reference.
        samples: Random poses.
        tolerance: Distances less than this are contact [m].

    Returns:
        (group, share of the poses in which its bodies touch), most frequent first.
    """
    check("scene", scene, Scene)
    check("samples", samples, Count)
    check("tolerance", tolerance, NotNegative)
    world, q = make_world(scene), random_poses(scene, samples)
    table, touches = scene.group_table(), Counter()
    for distance, geoms in contacts_of(scene, world, q, tolerance):
        near = geoms[distance < tolerance]
        touches.update(set(table[near[:, 0], near[:, 1]].tolist()) - {-1})
    shares = [
        (group.name, touches[index] / samples)
        for index, group in enumerate(scene.groups)
        if not group.held and touches[index] > OFTEN * samples
    ]
    return sorted(shares, key=lambda pair: -pair[1])


def random_poses(scene: Scene, count: int, seed: int = 0) -> np.ndarray:
    """`[count, d]` joints, uniform within the limits, or within +-pi where there are none."""
    limits = np.asarray(scene.q_min), np.asarray(scene.q_max)
    low, high = (np.nan_to_num(x, posinf=np.pi, neginf=-np.pi) for x in limits)
    rng = np.random.default_rng(seed)
    return rng.uniform(low, high, (count, len(low))).astype(np.float32)

"""Which contacts say nothing: bodies that touch wherever the arm is."""

from collections import Counter

import numpy as np

from jaxplan.collision.oracle import contacts_of
from jaxplan.collision.world import make_world
from jaxplan.ranges import Count, NotNegative, check
from jaxplan.scene import Group, Scene

OFTEN = 0.9
"""Share of poses from which on a contact is taken for one that is always there."""


def always_touching(
    scene: Scene, samples: int = 200, tolerance: float = 1e-4
) -> list[tuple[str, float]]:
    """Contact groups to exclude, or to ignore (`make_world`), by C MuJoCo.

    Bodies that touch in nearly every random pose leave nothing to plan, and neighbouring
    links often do. Bodies with no joint of the arm between them, such as two fingers, are
    listed whether they touch or not: no motion of the arm changes that.

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
        if not group.held
        and (touches[index] > OFTEN * samples or not _arm_between(scene, group))
    ]
    return sorted(shares, key=lambda pair: -pair[1])


def random_poses(scene: Scene, count: int, seed: int = 0) -> np.ndarray:
    """`[count, d]` joints, uniform within the limits, or within +-pi where there are none."""
    limits = np.asarray(scene.q_min), np.asarray(scene.q_max)
    low, high = (np.nan_to_num(x, posinf=np.pi, neginf=-np.pi) for x in limits)
    rng = np.random.default_rng(seed)
    return rng.uniform(low, high, (count, len(low))).astype(np.float32)


def _arm_between(scene: Scene, group: Group) -> bool:
    """Whether a joint of the arm moves one of the two bodies and not the other."""
    lines = [set(scene.line(side.body)) for side in group.contacts[0]]
    return bool(scene.arm_bodies & (lines[0] ^ lines[1]))

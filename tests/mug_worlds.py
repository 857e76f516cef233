"""Random worlds of the mug scene, for the collision tests."""

import numpy as np

from jaxplan.collision import World, make_world
from jaxplan.scene import Scene

FINGERS = ("left_finger|mug", "mug|right_finger")


def random_world(scene: Scene, rng: np.random.Generator, rows: int) -> World:
    """Worlds `[rows]`: a mug that stands, lies or is held; gripper open or closed."""
    height, radius = 0.095 / 2, 0.04
    yaw = rng.uniform(-np.pi, np.pi, rows)
    lying, held = rng.random((2, rows)) < 0.5
    pose = np.zeros((rows, 1, 7))
    pose[:, 0, :2] = rng.uniform([0.3, -0.3], [0.65, 0.3], (rows, 2))
    pose[:, 0, 2] = np.where(lying, radius, height)
    half = yaw / 2
    pose[:, 0, 3], pose[:, 0, 6] = np.cos(half), np.sin(half)
    # Lying: turned about x by 90 degrees first.
    turned = np.stack([np.cos(half), np.cos(half), np.sin(half), np.sin(half)], -1)
    pose[lying, 0, 3:] = turned[lying] / np.sqrt(2)
    inside = rng.uniform([-0.02, -0.02, 0.09], [0.02, 0.02, 0.16], (rows, 3))
    quat = rng.normal(size=(rows, 4))
    pose[held, 0, :3], pose[held, 0, 3:] = inside[held], quat[held]
    pose[:, 0, 3:] /= np.linalg.norm(pose[:, 0, 3:], axis=-1, keepdims=True)
    passive = np.where(rng.random((rows, 1)) < 0.5, 0.04, 0.002) * np.ones(2)
    ignored = rng.random((rows, len(scene.groups))) < 0.02
    ignored[held] |= scene.ignored([*FINGERS, "hand|mug"])
    world = make_world(scene, pose, held[:, None], passive)._replace(ignored=ignored)
    slots = (np.zeros((rows, 0, n)) for n in (7, 3))
    geoms = (np.broadcast_to(leaf, (rows, *leaf.shape)) for leaf in world[6:])
    return World(*world[:4], *slots, *geoms)  # every leaf with the rows in front

"""Poses as physics keeps them, and as matrices."""

import numpy as np
from scipy.spatial.transform import Rotation


def to_matrix(pose: np.ndarray) -> np.ndarray:
    """`[4, 4]` of a position and a quaternion (w, x, y, z), shape `[7]`."""
    matrix = np.eye(4)
    matrix[:3, 3] = pose[:3]
    matrix[:3, :3] = Rotation.from_quat(pose[3:], scalar_first=True).as_matrix()
    return matrix


def from_matrix(matrix: np.ndarray) -> np.ndarray:
    """Position and quaternion (w, x, y, z), shape `[7]`, of a `[4, 4]`."""
    quat = Rotation.from_matrix(matrix[:3, :3]).as_quat(scalar_first=True)
    return np.concatenate([matrix[:3, 3], quat])

"""What a demonstration shard holds, and the checks that every shard passes."""

from typing import Any, NamedTuple

import numpy as np

from jaxplan.robots.panda.mount import MOUNT

IMAGE_SHAPE = (MOUNT.height, MOUNT.width, 3)
PATH_POINTS = 64
NO_PATH = -1
TOGGLES = ("grasp1", "release1", "grasp2", "release2")


class DataError(ValueError):
    """Demonstrations are missing, damaged, or made with other settings."""


class Shard(NamedTuple):
    """Frames, the paths they lie on, and the episodes they come from.

    F frames, P paths, E episodes. A frame is one observation with its labels: what the
    gripper does next (`*_toggle`) and where the arm goes until then (`q_goal`).
    """

    image: np.ndarray
    """u8 [F, 88, 136, 3], RGB."""
    q: np.ndarray
    """f32 [F, d] [rad]."""
    gripper: np.ndarray
    """u8 [F]: 0 open, 1 closed."""
    q_toggle: np.ndarray
    """f32 [F, d], where the gripper toggles next [rad]."""
    gripper_toggle: np.ndarray
    """u8 [F], the gripper's mode after that toggle: 0 open, 1 closed."""
    q_goal: np.ndarray
    """f32 [F, d], the phase's subgoal [rad]."""
    toggle: np.ndarray
    """i8 [F], index into `TOGGLES` of the toggle that comes next."""
    seed: np.ndarray
    """i32 [F], the episode's seed."""
    camera_error: np.ndarray
    """f32 [F, 5], how the camera was off its mount: yaw, pitch [rad], right, up, back [m]."""
    path: np.ndarray
    """i32 [F], row of the path that the frame lies on; `NO_PATH` = none."""
    arc: np.ndarray
    """f32 [F], arc position of the frame on that path [rad]."""
    path_q: np.ndarray
    """f32 [P, 64, d], points uniform in arc length, phase start to q_goal [rad]."""
    path_length: np.ndarray
    """f32 [P], arc length [rad]."""
    episode_seed: np.ndarray
    """i32 [E]."""
    episode_success: np.ndarray
    """bool [E]."""
    episode_failure: np.ndarray
    """str [E], why the episode failed; empty = it did not."""


_ROWS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "image": (np.uint8, IMAGE_SHAPE),
    "q": (np.float32, ("d",)),
    "gripper": (np.uint8, ()),
    "q_toggle": (np.float32, ("d",)),
    "gripper_toggle": (np.uint8, ()),
    "q_goal": (np.float32, ("d",)),
    "toggle": (np.int8, ()),
    "seed": (np.int32, ()),
    "camera_error": (np.float32, (5,)),
    "path": (np.int32, ()),
    "arc": (np.float32, ()),
    "path_q": (np.float32, (PATH_POINTS, "d")),
    "path_length": (np.float32, ()),
    "episode_seed": (np.int32, ()),
    "episode_success": (np.bool_, ()),
    "episode_failure": (np.str_, ()),
}
"""Types and shapes of rows; d joints."""
_TABLES = (Shard._fields[:11], Shard._fields[11:13], Shard._fields[13:])


def as_shard(**columns: np.ndarray | list) -> Shard:
    """Casts columns to the schema's types, fills the empty ones' shapes, and checks."""
    joints = np.shape(columns["path_q"])[-1]
    cast = {
        name: np.asarray(columns[name], dtype).reshape(-1, *_row(name, joints))
        for name, (dtype, _) in _ROWS.items()
    }
    return check_shard(Shard(**cast))


def _row(name: str, joints: int) -> tuple[int, ...]:
    """Shape of a column's row."""
    return tuple(joints if size == "d" else size for size in _ROWS[name][1])


def check_shard(shard: Shard) -> Shard:
    """Returns `shard` unchanged, or raises DataError naming the first bad column."""
    joints = shard.path_q.shape[-1]
    for name, (dtype, _) in _ROWS.items():
        column, row = getattr(shard, name), _row(name, joints)
        if not np.issubdtype(column.dtype, dtype) or column.shape[1:] != row:
            raise DataError(
                f"{name} is {column.dtype}{list(column.shape)}, "
                f"expected {np.dtype(dtype).name}[N, {', '.join(map(str, row))}]"
            )
        if dtype is np.float32 and not np.isfinite(column).all():
            raise DataError(f"{name} holds a value that is not finite")
    for table in _TABLES:
        if len({len(getattr(shard, name)) for name in table}) > 1:
            raise DataError(f"columns of different lengths: {', '.join(table)}")
    for name, low, high in (
        ("gripper", 0, 1),
        ("gripper_toggle", 0, 1),
        ("toggle", 0, len(TOGGLES) - 1),
        ("path", NO_PATH, len(shard.path_q) - 1),
    ):
        column = getattr(shard, name)
        if column.size and (column.min() < low or column.max() > high):
            raise DataError(f"{name} leaves [{low}, {high}]")
    return shard


def concatenate(shards: list[Shard]) -> Shard:
    """One shard of all rows; `path` is shifted to the joint path table."""
    if not shards:
        raise DataError("no shards")
    columns, rows = [], 0
    for shard in shards:
        path = np.where(shard.path == NO_PATH, NO_PATH, shard.path + rows)
        columns.append(shard._replace(path=path.astype(np.int32)))
        rows += len(shard.path_q)
    return Shard(*(np.concatenate(column) for column in zip(*columns, strict=True)))

"""What a demonstration shard holds, and the checks that every shard passes."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from jaxplan.robots.panda.mount import MOUNT

IMAGE_SHAPE = (MOUNT.height, MOUNT.width, 3)
PATH_POINTS = 64
NO_PATH = -1
FRAME_PERIOD = 0.1
"""Time between two frames of a timed demonstration, and between two actions of a policy [s]."""
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


class TimedShard(NamedTuple):
    """Whole episodes, a frame each `FRAME_PERIOD`, and what the expert did until the next one.

    F frames, those of an episode one after another; E episodes. While the gripper toggles the arm
    waits, and no frames are kept.
    """

    image: np.ndarray
    """u8 [F, 88, 136, 3], RGB."""
    q: np.ndarray
    """f32 [F, d] [rad]."""
    gripper: np.ndarray
    """u8 [F]: 0 open, 1 closed."""
    action_q: np.ndarray
    """f32 [F, d], where the arm is commanded to be a period later [rad]."""
    action_gripper: np.ndarray
    """u8 [F], the gripper's mode from then on: 0 open, 1 closed."""
    toggle: np.ndarray
    """i8 [F], index into `TOGGLES` of the toggle that comes next."""
    seed: np.ndarray
    """i32 [F], the episode's seed."""
    camera_error: np.ndarray
    """f32 [F, 5], how the camera was off its mount: yaw, pitch [rad], right, up, back [m]."""
    episode_seed: np.ndarray
    """i32 [E]."""
    episode_success: np.ndarray
    """bool [E]."""
    episode_failure: np.ndarray
    """str [E], why the episode failed; empty = it did not."""


class PathShard(NamedTuple):
    """Paths of the problems of one scene, several ways each.

    N paths, P problems that were posed. What a sampler is told of a problem is kept as it is
    told (`samplers.scene.condition`), so that training needs no scene.
    """

    path_q: np.ndarray
    """f32 [N, 64, d], points uniform in arc length, start to goal [rad or m]."""
    path_length: np.ndarray
    """f32 [N], arc length [rad]."""
    state: np.ndarray
    """f32 [N, S], start and goal."""
    things: np.ndarray
    """f32 [N, n, T], obstacles and objects."""
    there: np.ndarray
    """bool [N, n], the others are empty slots."""
    problem: np.ndarray
    """i32 [N], the number of the problem that the path solves."""
    posed: np.ndarray
    """i32 [P], numbers of all problems."""
    reason: np.ndarray
    """str [P], why there is no path; empty = there is one."""


Demonstrations = Shard | TimedShard
KINDS: tuple[type[Any], ...] = (Shard, TimedShard, PathShard)

_ROWS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "image": (np.uint8, IMAGE_SHAPE),
    "q": (np.float32, ("d",)),
    "gripper": (np.uint8, ()),
    "q_toggle": (np.float32, ("d",)),
    "gripper_toggle": (np.uint8, ()),
    "q_goal": (np.float32, ("d",)),
    "action_q": (np.float32, ("d",)),
    "action_gripper": (np.uint8, ()),
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
    "state": (np.float32, ("S",)),
    "things": (np.float32, ("n", "T")),
    "there": (np.bool_, ("n",)),
    "problem": (np.int32, ()),
    "posed": (np.int32, ()),
    "reason": (np.str_, ()),
}
"""Types and shapes of rows; a letter stands for one size in a shard, d for the joints."""
_TABLES = {
    Shard: (Shard._fields[:11], Shard._fields[11:13], Shard._fields[13:]),
    TimedShard: (TimedShard._fields[:8], TimedShard._fields[8:]),
    PathShard: (PathShard._fields[:6], PathShard._fields[6:]),
}
"""Columns of one length."""


def as_shard(**columns: np.ndarray | list) -> Shard:
    """Casts columns to the schema's types, fills the empty ones' shapes, and checks."""
    return check_shard(Shard(**_cast(columns, {"d": np.shape(columns["path_q"])[-1]})))


def as_timed_shard(joints: int, **columns: np.ndarray | list) -> TimedShard:
    """The same of whole episodes, of an arm with so many joints."""
    return check_shard(TimedShard(**_cast(columns, {"d": joints})))


def as_path_shard(sizes: Mapping[str, int], **columns: np.ndarray | list) -> PathShard:
    """The same of paths; `sizes` says what d, S, n and T are."""
    return check_shard(PathShard(**_cast(columns, sizes)))


def _cast(
    columns: Mapping[str, np.ndarray | list], sizes: Mapping[str, int]
) -> dict[str, np.ndarray]:
    def cast(name: str, column: Any) -> np.ndarray:
        array = np.asarray(column, _ROWS[name][0])
        return array.reshape(len(array), *_row(name, sizes))

    return {name: cast(name, column) for name, column in columns.items()}


def _row(name: str, sizes: Mapping[str, int]) -> tuple[int, ...]:
    """Shape of a column's row."""
    return tuple(sizes.get(size, size) for size in _ROWS[name][1])


def _sizes(shard: Any) -> dict[str, int]:
    """What the letters in the shapes of rows stand for, in a shard of any kind."""
    found: dict[str, int] = {}
    for name, column in shard._asdict().items():
        for size, letter in zip(column.shape[1:], _ROWS[name][1], strict=False):
            if isinstance(letter, str):
                found.setdefault(letter, size)
    return found


def check_shard(shard: Any) -> Any:
    """Returns a shard of any kind unchanged, or raises DataError naming the first bad column."""
    sizes = _sizes(shard)
    for name, column in shard._asdict().items():
        dtype, row = _ROWS[name][0], _row(name, sizes)
        if not np.issubdtype(column.dtype, dtype) or column.shape[1:] != row:
            raise DataError(
                f"{name} is {column.dtype}{list(column.shape)}, "
                f"expected {np.dtype(dtype).name}[N, {', '.join(map(str, row))}]"
            )
        if dtype is np.float32 and not np.isfinite(column).all():
            raise DataError(f"{name} holds a value that is not finite")
    for table in _TABLES[type(shard)]:
        if len({len(getattr(shard, name)) for name in table}) > 1:
            raise DataError(f"columns of different lengths: {', '.join(table)}")
    for name, low, high in (
        ("gripper", 0, 1),
        ("gripper_toggle", 0, 1),
        ("action_gripper", 0, 1),
        ("toggle", 0, len(TOGGLES) - 1),
        ("path", NO_PATH, len(getattr(shard, "path_q", ())) - 1),
    ):
        column = getattr(shard, name, np.zeros(0))
        if column.size and (column.min() < low or column.max() > high):
            raise DataError(f"{name} leaves [{low}, {high}]")
    return shard


def concatenate(shards: list[Any]) -> Any:
    """One shard of all rows; `path` is shifted to the joint path table.

    Shards are taken off the list column by column, so that pictures are never there twice.
    """
    if not shards:
        raise DataError("no shards")
    kind, rows = type(shards[0]), 0
    columns: dict[str, list[np.ndarray]] = {name: [] for name in kind._fields}
    while shards:
        for name, column in shards.pop(0)._asdict().items():
            if name == "path":
                column = np.where(column == NO_PATH, NO_PATH, column + rows)
            columns[name].append(column.astype(np.int32) if name == "path" else column)
        rows += len(columns.get("path_q", [()])[-1])
    return kind(**{name: _joined(parts) for name, parts in columns.items()})


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    """All rows of one column; the parts are let go as they are copied."""
    if len(parts) == 1:
        return parts[0]
    if parts[0].dtype.kind == "U":  # texts of any length
        return np.concatenate(parts)
    whole = np.empty((sum(map(len, parts)), *parts[0].shape[1:]), parts[0].dtype)
    first = 0
    while parts:
        part = parts.pop(0)
        whole[first : first + len(part)] = part
        first += len(part)
    return whole

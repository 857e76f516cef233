"""The planner's door: arrays, seeds, limits and worlds as users give them, checked."""

import operator
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jaxplan.collision import World
from jaxplan.ik import Pose
from jaxplan.ranges import check, numbers, shown


def seeds_of(seeds: Iterable[Any]) -> list[int]:
    """Seeds as integers: Python's, NumPy's and JAX's, and arrays of these.

    Raises:
        ValueError: One that is no integer from 0 to 2^32 - 1; a boolean is none.
    """
    try:
        given = list(seeds)
    except TypeError:
        raise ValueError(f"seeds {shown(seeds)}, expected one a problem") from None
    return [_seed(seed) for seed in given]


def _seed(seed: Any) -> int:
    try:
        number = -1 if isinstance(seed, bool) else operator.index(seed)
    except TypeError:
        number = -1
    if not 0 <= number < 2**32:
        words = "expected an integer from 0 to 2^32 - 1"
        raise ValueError(f"seed {shown(seed)}, {words}")
    return number


def number(value: Any, kind: Any, name: str) -> float:
    """A number, or an array of one without axes, checked; see `jaxplan.ranges`."""
    plain = value.item() if getattr(value, "shape", None) == () else value
    check(name, plain, kind)
    return plain


def most(value: ArrayLike, d: int, name: str) -> np.ndarray:
    """`[d]` limits on speed or the like, checked."""
    limits = _each(value, d, name)
    if not ((limits > 0) & np.isfinite(limits)).all():
        raise ValueError(f"{name} {shown(value)}, expected more than 0")
    return limits


def joint_limits(
    given: tuple[ArrayLike | None, ArrayLike | None],
    own: tuple[ArrayLike, ArrayLike],
    joints: Sequence[str],
) -> tuple[np.ndarray, np.ndarray]:
    """`q_min [d]` and `q_max [d]`; what is not given is the model's own.

    Raises:
        ValueError: They are no numbers, or leave a joint no room, by name.
    """
    low, high = (
        _each(limit if value is None else value, len(joints), name)
        for value, limit, name in zip(given, own, ("q_min", "q_max"), strict=True)
    )
    room = (low < high) & (low < np.inf) & (high > -np.inf)
    for joint in np.flatnonzero(~room).tolist():
        raise ValueError(
            f"joint {joints[joint]!r} has limits {low[joint]} to {high[joint]}, "
            "expected q_min < q_max"
        )
    return low, high


def rows(q: ArrayLike, axes: int | None, d: int, name: str) -> np.ndarray:
    """q with `axes` axes (any number where None), the last of length d, as float32."""
    array = numbers(name, q)
    shape = array.shape
    if not shape or shape[-1] != d or (axes is not None and len(shape) != axes):
        leading = "..., " if axes is None else "problems, " * (axes - 1)
        expected = f"({leading}{d})" if leading else f"({d},)"
        raise ValueError(f"{name} has shape {shape}, expected {expected}")
    with np.errstate(over="ignore"):
        return array.astype(np.float32)


def goals(q: Any, d: int) -> list[Any]:
    """Goals of many problems, one by one: an array `[P, d]` or `[P, G, d]`, or a sequence."""
    if isinstance(q, Sequence) and not isinstance(q, str):
        return [
            goal if isinstance(goal, Pose) else rows(goal, None, d, "q_goals")
            for goal in q
        ]
    array = rows(q, None, d, "q_goals")
    if array.ndim not in (2, 3):
        raise ValueError(f"q_goals has shape {array.shape}, expected (problems, {d})")
    return list(array)


def waypoints(path: ArrayLike, d: int) -> np.ndarray:
    """A path `[n, d]` as a plan has it, checked: one waypoint at least, and all finite."""
    path = rows(path, 2, d, "path")
    if not len(path):
        raise ValueError("the path has no waypoints")
    for row in np.flatnonzero(~np.isfinite(path).all(-1)).tolist():
        raise ValueError(f"waypoint {row} of the path is not finite: {path[row]}")
    return path


def worlds_of(worlds: Iterable[World], ours: World, count: int) -> World | None:
    """Worlds for each of `count` problems, stacked; None for no problems.

    Raises:
        ValueError: One is no world of this scene, or there are more or fewer.
    """
    try:
        each = [world_of(world, ours, ()) for world in worlds]
    except TypeError:
        raise ValueError(f"worlds {shown(worlds)}, expected Worlds") from None
    if len(each) != count:
        raise ValueError(f"{len(each)} worlds for {count} problems")
    stacked: Any = map(np.stack, zip(*each, strict=True))
    return World(*stacked) if each else None


def batch_of(world: World, ours: World, batch: tuple[int, ...]) -> tuple[int, ...]:
    """The leading axes of a world's leaves, broadcast against `batch`.

    Raises:
        ValueError: They do not broadcast.
    """
    if not isinstance(world, World):
        raise ValueError(f"{type(world).__name__} is not a World, see make_world")
    arrays = map(_array, world, [f"world.{name}" for name in World._fields])
    leaves = zip(arrays, ours, strict=True)
    leading = [leaf.shape[: leaf.ndim - own.ndim] for leaf, own in leaves]
    try:
        return np.broadcast_shapes(batch, *leading)
    except ValueError:
        axes = ", ".join(map(str, dict.fromkeys(leading)))
        raise ValueError(
            f"the world's leading axes {axes} do not fit those of qs, {batch}"
        ) from None


def world_of(world: World, ours: World, batch: tuple[int, ...]) -> World:
    """The world in NumPy; all of its leaves have leading axes `batch`, or none has any.

    Args:
        world: As given.
        ours: One of the right shapes and types.
        batch: What the leaves' leading axes broadcast to, such as `(P,)`.

    Raises:
        ValueError: It is no world of this scene.
    """
    if not isinstance(world, World):
        raise ValueError(f"{type(world).__name__} is not a World, see make_world")
    leaves = []
    for name, leaf, own in zip(World._fields, world, ours, strict=True):
        leaves.append(_array(leaf, f"world.{name}", own.dtype))
        if not _broadcasts(leaves[-1].shape, own.shape, batch):
            wanted = " or ".join(sorted({str(own.shape), str((*batch, *own.shape))}))
            raise ValueError(
                f"world.{name} has shape {leaves[-1].shape}, expected {wanted}"
            )
    for name, leaf in zip(World._fields, leaves, strict=True):
        if name in ("slot_size", "geom_size") and (leaf < 0).any():
            raise ValueError(f"world.{name} has a negative size")
    if all(leaf.shape == own.shape for leaf, own in zip(leaves, ours, strict=True)):
        return World(*leaves)
    shapes = [(*batch, *own.shape) for own in ours]
    return World(*map(np.broadcast_to, leaves, shapes))  # type: ignore[arg-type]


def _array(leaf: Any, name: str, dtype: Any = None) -> np.ndarray:
    try:
        return np.asarray(leaf, dtype)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is not an array: {error}") from None


def _broadcasts(
    shape: tuple[int, ...], own: tuple[int, ...], batch: tuple[int, ...]
) -> bool:
    """Whether a leaf has its own axes, and before them some that broadcast to `batch`."""
    try:
        return np.broadcast_shapes(shape, (*batch, *own)) == (*batch, *own) and (
            shape[len(shape) - len(own) :] == own
        )
    except ValueError:
        return False


def _each(value: ArrayLike, d: int, name: str) -> np.ndarray:
    """A number for all joints, or `[d]`, as `[d]`."""
    array = numbers(name, value)
    if array.shape not in ((), (d,)):
        raise ValueError(f"{name} {shown(value)}, expected a number or {d}")
    return np.broadcast_to(array, d)

"""The planner's door: arrays, seeds and worlds as users give them, checked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jaxplan.collision import World


def seeds_of(seeds: Sequence[int]) -> list[int]:
    """Seeds, checked."""
    for seed in seeds:
        if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**32):
            raise ValueError(f"seed {seed!r}, expected an integer from 0 to 2^32 - 1")
    return list(seeds)


def most(value: ArrayLike, d: int, name: str) -> np.ndarray:
    """`[d]` limits, checked."""
    try:
        limits = np.broadcast_to(np.asarray(value, float), d)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} {value!r}, expected a number or {d}") from None
    if not ((limits > 0) & np.isfinite(limits)).all():
        raise ValueError(f"{name} {value}, expected more than 0")
    return limits


def rows(q: ArrayLike, axes: int, d: int, name: str) -> np.ndarray:
    """q with `axes` axes, the last of length d, as float32, checked."""
    try:
        q = np.asarray(q)
        q = q.astype(np.float64, casting="unsafe" if q.dtype == object else "same_kind")
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name} is not an array of numbers: {error}") from None
    if q.ndim != axes or q.shape[-1] != d:
        expected = f"({d},)" if axes == 1 else f"(problems, {d})"
        raise ValueError(f"{name} has shape {q.shape}, expected {expected}")
    with np.errstate(over="ignore"):
        return q.astype(np.float32)


def world_of(world: World, ours: World, batch: tuple[int, ...]) -> World:
    """The world in NumPy; all of its leaves have leading axes `batch`, or none has any.

    Args:
        world: As given.
        ours: One of the right shapes and types.
        batch: `(P,)`, or nothing.

    Raises:
        ValueError: It is no world of this scene.
    """
    if not isinstance(world, World):
        raise ValueError(f"{type(world).__name__} is not a World, see make_world")
    leaves: list[Any] = []
    for name, leaf, own in zip(World._fields, world, ours, strict=True):
        try:
            leaves.append(np.asarray(leaf, own.dtype))
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(f"world.{name} is not an array: {error}") from None
        if leaves[-1].shape not in (own.shape, (*batch, *own.shape)):
            wanted = " or ".join(sorted({str(own.shape), str((*batch, *own.shape))}))
            raise ValueError(
                f"world.{name} has shape {leaves[-1].shape}, expected {wanted}"
            )
    if (leaves[-1] < 0).any():
        raise ValueError("world.slot_size has a negative size")
    if all(leaf.shape == own.shape for leaf, own in zip(leaves, ours, strict=True)):
        return World(*leaves)
    shapes = [(*batch, *own.shape) for own in ours]
    return World(*map(np.broadcast_to, leaves, shapes))  # type: ignore[arg-type]

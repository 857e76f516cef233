"""Inverse kinematics: configurations that bring a body to a pose."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jaxplan.collision import World
from jaxplan.ik.descent import LANES, Window, descend
from jaxplan.ik.pose import Pose, Region, regions
from jaxplan.scene import Scene, movers

ROUNDS = 4
"""Calls of `LANES` starts at most for one pose."""
BATCH_ROUNDS = 16
"""Calls at most that a pose in a batch has part in."""
SAME = 0.05
"""Solutions of which no joint differs by more are one [rad or m]."""


class Limits(NamedTuple):
    """Of the joints, `[d]` each."""

    q_min: np.ndarray
    """[rad or m]; -inf where there is none."""
    q_max: np.ndarray
    """[rad or m]; inf where there is none."""
    circular: np.ndarray
    """Bool: turns that differ by 2 pi are the same."""


class Solutions(NamedTuple):
    """Configurations that bring a body to a pose, from the nearest to the reference on."""

    q: np.ndarray
    """`[n, d]` [rad or m]."""
    distance: np.ndarray
    """`[n]` of each to the reference, Euclidean."""
    blocked: np.ndarray
    """`[k, d]` others that reach the pose as well, and are not free, in the same order."""


def inverse_kinematics(
    scene: Scene,
    world: World,
    pose: Pose,
    limits: Limits | None = None,
    reference: ArrayLike | None = None,
    seed: int = 0,
    count: int = 32,
    config_free: Callable[[np.ndarray], ArrayLike] | None = None,
) -> Solutions:
    """Configurations that bring a body to a pose, by damped least squares from many starts.

    The starts spread from the reference over all that the joints can do. Where there are
    more than `count` solutions (a redundant arm has a continuum), these are the nearest to
    the reference and others far from each other. Joints that do not move the body stay at
    the reference. Compiles once for each body of a scene.

    Args:
        scene: The scene.
        world: Without batch axes; only what the body hangs on matters.
        pose: What is wanted.
        limits: Kept exactly; the model's where None.
        reference: `[d]` [rad or m]; the model's reference pose within the limits where None.
        seed: Of the starts, from 0 to 2^32 - 1.
        count: Solutions at most, free ones and others each; at least 1.
        config_free: `[B, d] -> [B]` bool, B always the same; without it all are free.

    Raises:
        ValueError: There is no such body, or the arm does not move it; a setting that makes
            no sense.
    """
    if count < 1:
        raise ValueError(f"count {count}, expected at least 1")
    limits = limits_of(scene) if limits is None else limits
    reference = _reference(scene, limits, reference)
    body, region = regions(scene, [pose])
    region = Region(*(np.repeat(leaf, LANES, -1) for leaf in region))
    window = _window(scene, limits, reference, _movers(scene, body))
    found: list[tuple[np.ndarray, np.ndarray]] = []
    spread = np.minimum(1, np.linspace(0, 2, LANES, dtype=np.float32))
    for call in range(ROUNDS):
        q, reached = map(
            np.asarray,
            descend(scene, world, body, region, window, np.uint32(seed), call, spread),
        )
        free = reached if config_free is None else reached & np.asarray(config_free(q))
        found.append((q[free], q[reached & ~free]))
        if free.any():
            break
    q, blocked = (
        _spread(np.concatenate(part), limits, reference, count)
        for part in zip(*found, strict=True)
    )
    return Solutions(q, np.linalg.norm(q - reference, axis=1), blocked)


def inverse_kinematics_batch(
    scene: Scene,
    world: World,
    poses: Sequence[Pose],
    limits: Limits | None = None,
    reference: ArrayLike | None = None,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """One configuration for each of many poses of a body.

    Args:
        scene: The scene.
        world: Without batch axes.
        poses: P, all of one body.
        limits: As in `inverse_kinematics`.
        reference: As there.
        seed: Of the starts, from 0 to 2^32 - 1.

    Returns:
        `[P, d]` joints [rad or m], and `[P]` bool whether they reach their pose.

    Raises:
        ValueError: As there; or the poses are of several bodies.
    """
    limits = limits_of(scene) if limits is None else limits
    reference = _reference(scene, limits, reference)
    best = np.tile(reference, (len(poses), 1))
    reached = np.zeros(len(poses), bool)
    if not len(poses):
        return best, reached
    body, region = regions(scene, poses)
    window = _window(scene, limits, reference, _movers(scene, body))
    spread = np.ones(LANES, np.float32)

    def attempt(call: int, rows: np.ndarray) -> tuple[np.ndarray, ...]:
        part = Region(*(leaf[:, rows] for leaf in region))
        answer = descend(
            scene, world, body, part, window, np.uint32(seed), call, spread
        )
        return rows, *map(np.asarray, answer)

    calls = 0
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for _ in range(BATCH_ROUNDS):
            rows = np.flatnonzero(~reached)
            if not len(rows):
                break
            parts = np.resize(rows, (-(-len(rows) // LANES), LANES))
            numbers = range(calls, calls + len(parts))
            calls += len(parts)
            for rows, q, there in pool.map(attempt, numbers, parts):
                best[rows[there]] = q[there]
                reached[rows[there]] = True
    return _within(best, limits, reference), reached


def limits_of(scene: Scene) -> Limits:
    """The model's; hinges without limits are circular."""
    q_min, q_max = np.asarray(scene.q_min, float), np.asarray(scene.q_max, float)
    hinges = np.array([scene.joint_kind(name) == "hinge" for name in scene.joints])
    return Limits(q_min, q_max, hinges & np.isinf(q_min) & np.isinf(q_max))


def _reference(scene: Scene, limits: Limits, reference: ArrayLike | None) -> np.ndarray:
    """`[d]`, checked."""
    d = len(scene.joints)
    if reference is None:
        own = np.asarray(scene.model.qpos0, float)[scene.addresses(scene.joints)]
        return np.clip(own, limits.q_min, limits.q_max)
    given = np.asarray(reference, float)
    if given.shape != (d,):
        raise ValueError(f"reference has shape {given.shape}, expected ({d},)")
    if not np.isfinite(given).all():
        raise ValueError(f"reference is not finite: {given.tolist()}")
    return given


def _movers(scene: Scene, body: str) -> np.ndarray:
    """`[d]` bool: joints that move the body."""
    moving = movers(scene.structure, scene.body_id(body))
    if not moving.any():
        raise ValueError(f"no joint of the arm moves body {body!r}")
    return moving


def _window(
    scene: Scene, limits: Limits, reference: np.ndarray, moving: np.ndarray
) -> Window:
    """Where starts are drawn: around the reference, within the limits.

    Of a hinge no more than a turn, of a slide without limits two metres; joints that do
    not move the body stay.
    """
    low, high, _ = limits
    hinge = np.array([scene.joint_kind(name) == "hinge" for name in scene.joints])
    width = np.where(hinge, 2 * np.pi, np.where(np.isinf(high - low), 2, np.inf))
    width = np.where(moving, np.minimum(width, high - low), 0)
    near = np.clip(reference, low, high)
    first = np.clip(near - width / 2, low, high - width)
    return Window(low, high, first, first + width, near)


def _within(q: np.ndarray, limits: Limits, reference: np.ndarray) -> np.ndarray:
    """Limits to the last bit, and circular joints within half a turn of the reference."""
    turns = np.where(limits.circular, np.round((q - reference) / (2 * np.pi)), 0)
    return np.clip(q - 2 * np.pi * turns, limits.q_min, limits.q_max)


def _spread(
    q: np.ndarray, limits: Limits, reference: np.ndarray, count: int
) -> np.ndarray:
    """The nearest to the reference, then always the one farthest from those before.

    Returns:
        `[<= count, d]` by distance to the reference, none the same as another.
    """
    q = _within(q, limits, reference)
    q = q[np.argsort(np.linalg.norm(q - reference, axis=1), kind="stable")]
    kept, gap = [], np.full(len(q), np.inf)
    while len(kept) < count and gap.max(initial=0) > SAME:
        kept.append(int(gap.argmax()))
        apart = np.abs(q - q[kept[-1]])
        around = np.where(limits.circular, np.minimum(apart, 2 * np.pi - apart), apart)
        gap = np.minimum(gap, around.max(1))
    return q[sorted(kept)]

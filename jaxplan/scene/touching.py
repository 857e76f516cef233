"""Geoms that touch wherever the arm is, by C MuJoCo: contacts that say nothing.

Collision shapes are simpler than the robot, so neighbouring ones often overlap for good:
every problem would answer START_IN_COLLISION. Which pairs may be left out for that is a
question of safety, for what is left out is not checked:

    both moved by the arm, or neighbours      if they touch in every random pose
    neighbours of one robot                   if they touch in most random poses
    with an object or a slot                  never: a query may put it elsewhere

Neighbours have at most one other body with geoms between them in the kinematic tree. Of
what stands still, only the body that carries the arm belongs to the robot: a wall that the
upper arm hits in most poses is an obstacle, a door beside the robot is no neighbour, and
the hull of a room around it still stops its hand. A pose in a key frame proves nothing: a
folded arm rests on itself, and must not fall through itself later.
"""

import copy
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from functools import cache
from typing import NamedTuple

import mujoco
import numpy as np

from jaxplan.scene.chain import line
from jaxplan.scene.dependent import Dependent, follow

TOUCH = 1e-4
"""Distances below this are contact: surfaces that lie on each other are apart by rounding [m]."""
POSES = 400
"""Random poses, besides the reference and the key frames."""
OFTEN = 0.7
"""Share of poses from which on neighbours of a robot count as always touching: of published
robots, the tubes of a telescope reach 0.73 to 0.75, arms that can hit their torso 0.56."""
NEIGHBOURS = 2
"""Steps between bodies with geoms that still make neighbours: one other stands between."""
NEARLY = 0.9
"""Share of poses in which neighbours that are always near keep below a distance."""
CLOSE = 0.03
"""Distances of neighbours beyond this say nothing [m]."""


class Moving(NamedTuple):
    """What moves in a model; see `Structure`."""

    moved: frozenset[int]
    """Bodies that the arm moves first."""
    variables: tuple[int, ...]
    """Joint ids, the dependent ones last."""
    dependent: tuple[Dependent, ...]


class Kinship(NamedTuple):
    """How two geoms belong together."""

    moved: bool
    """A joint of the arm moves one and not the other."""
    both: bool
    """Joints of the arm move both."""
    neighbours: bool
    robot: bool
    """Neighbours of one robot: neither only stands in the world."""


def touching_pairs(
    model: mujoco.MjModel, motion: Moving, apart: Iterable[int]
) -> dict[tuple[int, int], float]:
    """Pairs of geoms that leave nothing to plan, and the share of poses in which they touch.

    Args:
        model: The model.
        motion: What moves; passive joints are drawn at random as the arm's are.
        apart: Bodies that queries place: objects, and that of the slots.
    """
    kin, apart = kinships(model, motion.moved), set(apart)
    model = _bare(model)
    for body in apart & set(np.flatnonzero(model.body_weldid == 0).tolist()):
        model.geom_pos[model.geom_bodyid == body] = 1000.0  # slots: out of the way
    data, touches = mujoco.MjData(model), Counter()
    rows = _poses(model, motion, POSES)
    for qpos in rows:
        touches.update(_touching(model, data, qpos))
    shares = {}
    for pair, count in touches.items():
        i, j = pair
        lines = [{int(b), *line(model, b)} for b in model.geom_bodyid[[i, j]]]
        if apart & (lines[0] ^ lines[1]):
            continue
        own = kin(i, j)
        always = count == len(rows) and (own.both or own.neighbours)
        often = count >= OFTEN * len(rows) and own.robot
        if own.moved and (always or often):
            shares[pair] = count / len(rows)
    return shares


def near_distances(
    model: mujoco.MjModel, motion: Moving, pairs: Iterable[tuple[int, int]]
) -> dict[tuple[int, int], float]:
    """Neighbours of the robot that are nearly always close, and how close [m].

    Args:
        model: The model.
        motion: What moves.
        pairs: Of geoms that are checked.

    Returns:
        `(i, j)`, i < j: the distance that `NEARLY` all poses keep below, up to `CLOSE`.
    """
    kin = kinships(model, motion.moved)
    plane = mujoco.mjtGeom.mjGEOM_PLANE
    found = {
        (min(pair), max(pair)): []
        for pair in pairs
        if kin(*pair).moved
        and kin(*pair).robot
        and plane not in model.geom_type[list(pair)]
    }
    model = _bare(model)
    data, rows = mujoco.MjData(model), _poses(model, motion, POSES // 4)
    misses, allowed = Counter(), (1 - NEARLY) * len(rows)
    for qpos in rows if found else ():
        touching = _touching(model, data, qpos)
        for pair in [pair for pair in found if misses[pair] <= allowed]:
            distance = mujoco.mj_geomDistance(model, data, *pair, CLOSE, None)
            # It takes some meshes that are apart for overlapping; contacts know better.
            doubtful = distance < 0 and pair not in touching
            misses[pair] += doubtful or distance >= CLOSE
            found[pair].append(max(distance, 0.0))
    return {
        pair: float(np.quantile(distances, NEARLY))
        for pair, distances in found.items()
        if misses[pair] <= allowed
    }


def kinships(
    model: mujoco.MjModel, moved: Collection[int]
) -> Callable[[int, int], Kinship]:
    """A function of two geoms.

    Args:
        model: The model.
        moved: Bodies that the arm moves first.
    """
    weld = model.body_weldid
    can = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    can[model.pair_geom1] = can[model.pair_geom2] = True
    bodies = set(model.geom_bodyid[can].tolist())
    solid = {0, *weld[list(bodies)].tolist()}
    heads = set(weld[list(moved)].tolist())

    @cache
    def above(body: int) -> list[int]:
        """Rigid bodies from this one up, 0 = what stands still; only those with geoms."""
        rigid = dict.fromkeys(int(weld[b]) for b in (*line(model, body), 0))
        return [b for b in rigid if b in solid]

    @cache
    def joints(body: int) -> set[int]:
        """Rigid bodies from this one up on which joints of the arm are."""
        return heads & {int(weld[b]) for b in line(model, body)}

    @cache
    def carrier(body: int) -> int:
        """What stands still and carries the body, 0 = nothing but the world."""
        still = (b for b in line(model, body) if not weld[b] and b in bodies)
        return next(still, 0)

    @cache
    def kinship(a: int, b: int) -> Kinship:
        ways = above(a), above(b)
        meet = next(x for x in ways[0] if x in ways[1])
        steps = [way.index(meet) for way in ways]
        apart = meet == 0 not in steps  # with what stands still between them
        neighbours = sum(steps) <= NEIGHBOURS
        neighbours &= not apart or 0 != carrier(a) == carrier(b)
        base = not apart and all(
            x and x == carrier(y) for x, y in ((a, b), (b, a)) if not weld[x]
        )
        return Kinship(
            moved=joints(a) != joints(b),
            both=bool(joints(a) and joints(b)),
            neighbours=neighbours,
            robot=neighbours and base,
        )

    body = model.geom_bodyid
    return lambda i, j: kinship(int(body[i]), int(body[j]))


def _bare(model: mujoco.MjModel) -> mujoco.MjModel:
    """The model with contacts where geoms are closer than `TOUCH`, and nowhere else."""
    model = copy.copy(model)
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_MIDPHASE
    model.opt.disableflags &= ~(flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT)
    model.opt.enableflags = 0
    for margin in (model.geom_margin, model.body_margin, model.pair_margin):
        margin[:] = TOUCH
    model.geom_gap[:] = model.pair_gap[:] = 0
    return model


def _touching(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray
) -> set[tuple[int, int]]:
    """Pairs of geoms `(i, j)`, i < j, that are closer than `TOUCH`."""
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    geoms = data.contact.geom
    close = geoms[(data.contact.dist < TOUCH) & (geoms >= 0).all(-1)]  # -1: a flex
    return {(i, j) for i, j in np.sort(close, -1).tolist()}


def _poses(model: mujoco.MjModel, motion: Moving, count: int) -> np.ndarray:
    """`[n, nq]`: random hinges and slides, the reference and key frames if within limits."""
    ids = list(motion.variables)
    limited = model.jnt_limited[ids] != 0
    low, high = (
        np.where(limited, model.jnt_range[ids, side], (-np.pi, np.pi)[side])
        for side in (0, 1)
    )
    where = model.jnt_qposadr[ids]
    rows = np.tile(model.qpos0, (count, 1))
    rows[:, where] = np.random.default_rng(0).uniform(low, high, (count, len(ids)))
    named = np.concatenate([model.qpos0[None], model.key_qpos])
    inside = (named[:, where] >= low) & (named[:, where] <= high)
    rows = np.concatenate([rows, named[inside.all(-1)]])
    free = len(ids) - len(motion.dependent)
    moved = (rows - model.qpos0)[:, where].T
    rows[:, where] = model.qpos0[where] + np.stack(
        follow(motion.dependent, moved[:free]), -1
    )
    return rows

"""C MuJoCo's answer to the same questions: the oracle."""

import math
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from jaxplan.collision.checks import checked
from jaxplan.collision.positions import carry, free_objects, qpos_rows
from jaxplan.collision.replica import fill, look_within, mujoco_model
from jaxplan.collision.world import OWN_AXES, World, batch_shape
from jaxplan.ranges import NotNegative, check
from jaxplan.scene import Scene
from jaxplan.scene.contacts import KINDS

PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
BOX = int(mujoco.mjtGeom.mjGEOM_BOX)
ITERATED = [
    code for code, name in KINDS.items() if name in ("ellipsoid", "cylinder", "mesh")
]


def clearance_mujoco(
    scene: Scene, world: World, q: npt.ArrayLike, reach: float = 0.05
) -> np.ndarray:
    """As `clearance`, by C MuJoCo; distances beyond `reach` come out as inf.

    Args:
        scene: The scene.
        world: Its leading axes broadcast against those of q.
        q: `[..., d]` joints [rad].
        reach: How far pairs are looked for [m].
    """
    world, q = checked(scene, world, q=q)
    check("reach", reach, NotNegative)
    q = np.asarray(q, float)
    shape = batch_shape(world, q)
    rows = np.broadcast_to(q, (*shape, q.shape[-1])).reshape(-1, q.shape[-1])
    answers = nearest(scene, _rows(world, shape), rows, reach)
    return np.array([distance for distance, _ in answers]).reshape(shape)


def contacts_of(
    scene: Scene, world: World, rows: np.ndarray, reach: float = 0.0
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """All contacts that count, configuration by configuration.

    Args:
        scene: The scene.
        world: One for all, or leaves `[n, ...]`.
        rows: `[n, d]` joints.
        reach: How far pairs are looked for [m].

    Yields:
        Distances `[k]` [m] and geoms `[k, 2]`.
    """
    replica = Replica(scene)
    replica.load(world, rows)
    for row in range(len(rows)):
        replica.pose(row)
        yield replica.contacts(reach)


def nearest(
    scene: Scene, world: World, rows: np.ndarray, reach: float
) -> Iterator[tuple[float, tuple[int, int] | None]]:
    """Least distance of each row and its geoms; see `contacts_of`."""
    for distance, geoms in contacts_of(scene, world, rows, reach):
        if len(distance):
            deepest = int(distance.argmin())
            i, j = map(int, geoms[deepest])
            yield float(distance[deepest]), (i, j)
        else:
            yield math.inf, None


def names_of(scene: Scene, geoms: tuple[int, int] | None) -> tuple[str, str] | None:
    """Both geoms by name."""
    return geoms and (scene.geom_name(geoms[0]), scene.geom_name(geoms[1]))


class Replica:
    """A scene in C MuJoCo, put into one configuration after another.

    Attributes:
        model: Its model.
        data: Its state, after `pose`.
        counts: After `load`: `[n, n_groups + 1]` whether each contact group counts; the
            last, which group_table has as -1, never does (a static body on another).
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.model = scene, mujoco_model(scene)
        self.data = mujoco.MjData(self.model)
        self._table = scene.group_table()
        self._mocap = self.model.body_mocapid[[scene.body_id(n) for n in scene.mocap]]
        kind = self.model.geom_type
        self._box, self._plane = kind == BOX, kind == PLANE
        self._iterated = np.isin(kind, ITERATED)
        both = self._box[:, None] & self._box & (self._table >= 0)
        self._boxes = np.argwhere(np.triu(both))

    def load(self, world: World, rows: np.ndarray) -> None:
        """Takes configurations `[n, d]` in; the world is one for all, or leaves `[n, ...]`."""
        self._worlds = worlds = _rows(world, (len(rows),))
        self._qpos = qpos_rows(self._scene, worlds, rows)
        counts = np.pad(~worlds.ignored, ((0, 0), (0, 1)))
        for index, group in enumerate(self._scene.groups):
            if group.held:
                counts[:, index] &= worlds.held[:, list(group.held)].any(-1)
        self.counts, self._carries = counts, worlds.held.any(-1)
        # Filling slots takes as long as the rest, and mostly they stay as they are.
        given = worlds.slot_pose, worlds.slot_size, worlds.geom_pos, worlds.geom_size
        own = np.concatenate(
            [np.reshape(x, (len(rows), math.prod(np.shape(x)[1:]))) for x in given], 1
        )
        self._fills = np.ones(len(rows), bool)
        if len(rows) > 1:
            self._fills[1:] = (own[1:] != own[:-1]).any(1)
        self._row = -2

    def pose(self, row: int) -> None:
        """Puts geoms where they are in one of the configurations."""
        scene, model, data, worlds = self._scene, self.model, self.data, self._worlds
        changes = bool(scene.slots or scene.shaped)
        if changes and (self._fills[row] or row != self._row + 1):
            fill(scene, model, World(*(leaf[row] for leaf in worlds)))
        self._row = row
        data.qpos[:] = self._qpos[row]
        if scene.mocap:
            placed = worlds.object_pose[row, free_objects(scene) :]
            data.mocap_pos[self._mocap] = placed[:, :3]
            data.mocap_quat[self._mocap] = placed[:, 3:]
        mujoco.mj_kinematics(model, data)
        if self._carries[row]:
            carry(scene, data, np.asarray(worlds.held[row]))
            mujoco.mj_kinematics(model, data)

    def contacts(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Distances `[k]` [m] and geoms `[k, 2]` of pairs that are within `reach` here."""
        look_within(self.model, reach)
        mujoco.mj_collision(self.model, self.data)
        geoms, distance = self.data.contact.geom.copy(), self.data.contact.dist.copy()
        counts = self.counts[self._row]
        if len(distance):
            kept = counts[self._table[geoms[:, 0], geoms[:, 1]]]
            geoms, distance = geoms[kept], distance[kept]
            self._measure(geoms, distance)
        if reach > 0:
            if (distance <= 0).any():
                self._doubt(geoms, distance)
            far, boxes = self._distant_boxes(counts, reach)
            distance, geoms = np.append(distance, far), np.append(geoms, boxes, 0)
        near = distance <= reach
        return distance[near], geoms[near]

    def _measure(self, geoms: np.ndarray, distance: np.ndarray) -> None:
        """Corrects, in place, distances `[k]` of `geoms [k, 2]` that have no closed form.

        `mj_collision` finds all pairs within the margin, but takes the distance of such a
        pair from the depth of geoms blown up by it: centimetres off for a capsule near a
        cylinder, and millimetres where they touch. `mj_geomDistance` measures the geoms
        themselves.
        """
        i, j = geoms.T
        wrong = self._iterated[i] | self._iterated[j]
        wrong &= ~(self._plane[i] | self._plane[j])
        # Boxes that are apart, by up to centimetres.
        wrong |= self._box[i] & self._box[j] & (distance > 0)
        for row in wrong.nonzero()[0]:
            distance[row] = self.distance(
                i[row], j[row], max(1.0, 2 * float(distance[row]))
            )

    def distance(self, i: int, j: int, most: float) -> float:
        """Signed distance of two geoms [m], or `most` if that is less."""
        return mujoco.mj_geomDistance(
            self.model, self.data, int(i), int(j), float(most), None
        )

    def _distant_boxes(
        self, counts: np.ndarray, reach: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Distances of boxes that are apart, and the boxes.

        `mj_collision` overlooks some of them that are within the margin, by any amount.
        """
        i, j = self._boxes.T
        pairs = self._boxes[counts[self._table[i, j]]]
        centre, ball = self.data.geom_xpos[pairs], self.model.geom_rbound[pairs]
        apart = np.linalg.norm(centre[:, 0] - centre[:, 1], axis=-1) - ball.sum(-1)
        pairs = pairs[apart <= reach]
        distance = np.array([self.distance(i, j, 2 * reach) for i, j in pairs])
        return distance[distance > 0], pairs[distance > 0]

    def _doubt(self, geoms: np.ndarray, distance: np.ndarray) -> None:
        """Sets to just above 0, in place, distances of geoms that `mj_collision` sees apart.

        `mj_geomDistance` lets some meshes overlap that are not even near: Kinova's Jaco,
        base and upper arm, 21 mm deep where they are 33 mm apart. Without a margin the
        verdict of `mj_collision`, which physics uses, is right about them.
        """
        look_within(self.model, 0.0)
        mujoco.mj_collision(self.model, self.data)
        touching = {frozenset(pair) for pair in self.data.contact.geom.tolist()}
        for row in np.flatnonzero(distance <= 0):
            if frozenset(geoms[row].tolist()) not in touching:
                distance[row] = np.finfo(float).tiny


def _rows(world: World, shape: tuple[int, ...]) -> World:
    """The world's leaves as `[n, ...]` NumPy arrays, n = size of the shape."""

    def one(leaf: Any, own: Any) -> Any:
        tail = leaf.shape[leaf.ndim - own :]
        rows = np.broadcast_to(np.asarray(leaf), (*shape, *tail))
        return rows.reshape(math.prod(shape), *tail)

    return World(*(one(*pair) for pair in zip(world, OWN_AXES, strict=True)))

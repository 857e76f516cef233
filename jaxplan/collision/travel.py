"""How far geoms move while joints do: bounds, and no samples.

A hinge that turns by a moves what it carries by at most a times the distance from its
axis, a slide by as far as it goes. Joints are taken one after the other, the last of the
arm first: what those have moved by then adds to the distance from the axis of the next.
Joints that carry both geoms of a pair leave their distance as it is.

Of spheres and capsules the core counts, the point or line in their middle: a sphere that
turns on the spot does not move.
"""

import mujoco
import numpy as np

from jaxplan.collision.oracle import Replica
from jaxplan.scene import Scene, dependent
from jaxplan.scene.contacts import KINDS


class Travel:
    """Bounds for the pairs that count in one world.

    Args:
        scene: The scene.
        replica: Its C model, with that world loaded in row 0.
        held: `[n_objects]` bool.
        path: `[n, d]` joints; bounds are for what lies between these.
    """

    def __init__(
        self, scene: Scene, replica: Replica, held: np.ndarray, path: np.ndarray
    ) -> None:
        self._replica, model = replica, replica.model
        self._joints, self._rates = _moved_joints(scene, path)
        self._slides = model.jnt_type[self._joints] == mujoco.mjtJoint.mjJNT_SLIDE
        carried = _carried(scene, held, self._joints)[model.geom_bodyid]
        counts = replica.counts[0][scene.group_table()]
        i, j = np.nonzero(np.triu(counts))
        ways = np.concatenate([np.stack([i, j], -1), np.stack([j, i], -1)])
        own = carried[ways[:, 0]] & ~carried[ways[:, 1]]
        # Many pairs share what moves: a geom against all that stands still.
        sides, which = np.unique(
            np.column_stack([ways[:, 0], own]), axis=0, return_inverse=True
        )
        self._geoms, self._own = sides[:, 0], sides[:, 1:].astype(bool)
        self._side = np.zeros_like(counts, int)
        self._side[*ways.T] = which
        self._pairs = np.unique(which.reshape(2, -1), axis=1)

    def sides(self, half: np.ndarray) -> np.ndarray:
        """Bounds `[s]` [m] near where the replica is, for `pair` and `most`.

        Args:
            half: `[d]` how far each joint of the arm may be from there [rad or m].
        """
        model, data, geoms = self._replica.model, self._replica.data, self._geoms
        axis, anchor = data.xaxis[self._joints], data.xanchor[self._joints]
        offset = data.geom_xpos[geoms][:, None] - anchor
        along = np.einsum("skx,kx->sk", offset, axis)
        across = np.sqrt(np.maximum((offset**2).sum(-1) - along**2, 0))
        kind = model.geom_type[geoms]
        round_ = np.isin(
            kind, [c for c, k in KINDS.items() if k in ("sphere", "capsule")]
        )
        core = model.geom_rbound[geoms] - round_ * model.geom_size[geoms, 0]
        across += core[:, None]
        turn = self._rates @ half
        moved = np.zeros(len(geoms))
        for k in reversed(range(len(turn))):
            arm = 1.0 if self._slides[k] else across[:, k] + moved
            moved = moved + self._own[:, k] * turn[k] * arm
        return moved

    def pair(self, sides: np.ndarray, geoms: np.ndarray) -> np.ndarray:
        """How far the two geoms of each pair `[k, 2]` may come nearer or farther [m]."""
        i, j = geoms.T
        return sides[self._side[i, j]] + sides[self._side[j, i]]

    def most(self, sides: np.ndarray) -> float:
        """The same of any pair that counts [m]."""
        return float(sides[self._pairs].sum(0).max(initial=0.0))


def _moved_joints(scene: Scene, path: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ids of the joints that move on a path, from the world down, and their rates `[n, d]`.

    A rate is how far a joint moves at most while one of the arm's moves by 1.
    """
    structure, d = scene.structure, path.shape[1]
    ids = np.array(structure.variables)
    reference = np.asarray(scene.model.qpos0, float)[scene.addresses(scene.joints)]
    ends = (path.min(0) - reference, path.max(0) - reference)
    still = [(0.0, 0.0)] * len(scene.passive)
    where = [*zip(*map(np.ndarray.tolist, ends), strict=True), *still]
    rates = dependent.rates(structure.dependent, where, d)
    order = np.argsort(ids)
    order = order[rates[order].any(-1)]
    return ids[order], rates[order]


def _carried(scene: Scene, held: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """`[nbody, n]` whether each joint carries each body, held objects with the hand."""
    model, hand = scene.mj_model, scene.body_id(scene.hand)
    roots = {scene.body_id(name) for name in np.array(scene.objects)[held]}
    rows = []
    for body in range(model.nbody):
        above = scene.line(body)
        if roots & set(above):
            above = [*above, *scene.line(hand)]
        rows.append(np.isin(model.jnt_bodyid[joints], above))
    return np.array(rows)

"""What planning may know of a batch of episodes, as worlds of one scene."""

from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.collision import World
from jaxplan.collision.obstacles import Obstacle, fill
from jaxplan.robots import Robot
from jaxplan.scene import Scene
from jaxplan.scene.excludes import ALWAYS
from jaxplan.scene.source import SLOTS
from jaxplan.tasks.poses import from_matrix


class Planned:
    """The scene that planning sees, and what differs from lane to lane.

    Args:
        model: What collides.
        robot: Whose arm moves.
        allowed: Contacts that a phase allows, by how the object is (`free` or `held`) and
            whether a toggle is near.
        shaped: Objects of which each lane has its own.
        batch: B, how many lanes there are.
        zones: How many boxes there can be that the hand, and what it holds, keeps out of.
    """

    def __init__(
        self,
        model: mujoco.MjModel | mujoco.MjSpec,
        robot: Robot,
        allowed: Mapping[tuple[str, bool], list[str]],
        shaped: list[str],
        batch: int,
        zones: int = 0,
    ) -> None:
        self.scene = _scene(model, robot, shaped, zones)
        none = tuple(np.asarray(leaf) for leaf in fill(self.scene, []))
        self._zones = [none] * batch
        """Poses and sizes of the lanes' zones."""
        self._robot = robot
        self._allowed = {key: self.scene.ignored(allowed[key]) for key in allowed}
        rows, numbers = list(self.scene.shaped), self.scene.model
        own = (np.asarray(leaf)[rows] for leaf in (numbers.geom_pos, numbers.geom_size))
        self._geoms = [tuple(own)] * batch
        """Places and sizes of the lanes' objects."""

    def give(
        self, lane: int, geoms: Mapping[str, tuple[np.ndarray, np.ndarray]]
    ) -> None:
        """A lane's object has geoms of these places and sizes [m], by name."""
        names = map(self.scene.geom_name, self.scene.shaped)
        pos, size = zip(*(geoms[name] for name in names), strict=True)
        self._geoms[lane] = np.array(pos, np.float32), np.array(size, np.float32)

    def begin(self, lane: int, zones: Sequence[Obstacle]) -> None:
        """A lane's episode has these zones."""
        pose, size = fill(self.scene, zones)
        self._zones[lane] = np.asarray(pose), np.asarray(size)

    def leaves(
        self, lane: int, pose: np.ndarray, held: bool, touching: bool, qpos: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Of a lane's `World`.

        Args:
            lane: Whose.
            pose: `[4, 4]` of the object, in the hand if it is held.
            held: Whether it is.
            touching: Whether a toggle is near.
            qpos: `[nq]` of physics: where the fingers are.
        """
        fingers = qpos[self._robot.finger_slice]
        return (
            from_matrix(pose)[None].astype(np.float32),
            np.array([held]),
            fingers.clip(0, self._robot.gripper.open).astype(np.float32),
            self._allowed["held" if held else "free", touching],
            *self._zones[lane],
            *self._geoms[lane],
        )


def _scene(
    model: mujoco.MjModel | mujoco.MjSpec, robot: Robot, shaped: list[str], zones: int
) -> Scene:
    """Where links before the hand may be in zones."""
    if not zones:
        return Scene.from_mjcf(model, shaped=shaped)
    assert isinstance(model, mujoco.MjSpec), "zones need a model that is not compiled"
    links, body = [], model.body(robot.hand).parent
    while body.name != "world":
        links.append((body.name, SLOTS))
        body = body.parent
    return Scene.from_mjcf(
        model, slots={"box": zones}, exclude=[ALWAYS, *links], shaped=shaped
    )


def stacked(rows: list[tuple[np.ndarray, ...]]) -> World:
    """One world a row."""
    return World(*(jnp.asarray(np.stack(leaf)) for leaf in zip(*rows, strict=True)))

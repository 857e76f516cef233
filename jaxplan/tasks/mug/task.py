"""The mug task as physics sees it: reset, observe, move, toggle, judge. A batch of episodes."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from jaxplan.collision import World
from jaxplan.scene import Scene
from jaxplan.simulation.camera import Camera
from jaxplan.simulation.physics import Simulator
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.kinematics import RETREAT, InverseKinematics
from jaxplan.tasks.mug.mug import MugShape


class MugRange(NamedTuple):
    """Where `reset` puts the mug: uniform in each, lying, its handle on either side."""

    x: tuple[float, float] = (0.400, 0.552)
    y: tuple[float, float] = (-0.127, 0.127)
    yaw: tuple[float, float] = (np.radians(43.5), np.radians(144.5))
    """Direction of the opening [rad]."""
    roll: float = np.radians(8)
    """Largest angle by which the handle is off its resting place [rad]."""
    pitch: float = np.radians(3)
    drop: float = 0.006
    """Height above the table at the start [m]."""


RANGE = MugRange()
SETTLE = 0.8
"""Time to come to rest after the drop [s]."""


class Observation(NamedTuple):
    """What the predictor is shown of B episodes: nothing else reaches the networks."""

    image: np.ndarray
    """(B, 88, 136, 3) uint8, from one camera."""
    q: np.ndarray
    """(B, 7) [rad]."""
    gripper: np.ndarray
    """(B,) uint8: 0 open, 1 closed."""


class MugTask:
    """A batch of mug episodes in C MuJoCo.

    Args:
        batch: Number of episodes side by side.
        camera: `hand` or `static`.
        friction: Factor on every friction coefficient (0 shows that grasps hold by friction alone).
    """

    def __init__(
        self,
        batch: int,
        camera: str = "hand",
        friction: float = 1.0,
        shape: MugShape = MugShape(),
    ) -> None:
        model = scene.build("physics", shape)
        model.geom_friction *= friction
        self.model, self.shape, self.batch = model, shape, batch
        self.sim = Simulator(model, batch)
        self.closed = np.zeros(batch, bool)
        self._camera_name = camera
        self._camera: Camera | None = None
        self._pads = {model.geom("left_pad").id: 0, model.geom("right_pad").id: 1}
        self._mug_body = model.body("mug").id
        self._kinematics = InverseKinematics(model)
        self.planning_scene = Scene.from_mjcf(scene.build("planning", shape))
        self._allowed = {
            key: self.planning_scene.ignored(names)
            for key, names in allowed_contacts().items()
        }

    def reset(self, episodes: Sequence[int], seeds: Sequence[int]) -> None:
        """Starts episodes: arm at home, gripper open, mug dropped and come to rest.

        The result depends on the seed alone, bit for bit. Nothing asks whether the pose is easy.
        """
        for episode, seed in zip(episodes, seeds, strict=True):
            data = self.sim.data[episode]
            mujoco.mj_resetDataKeyframe(self.model, data, 0)
            position, rotation = sample_pose(seed, self.shape)
            data.qpos[9:12] = position
            data.qpos[12:16] = Rotation.from_matrix(rotation).as_quat()[[3, 0, 1, 2]]
            self.closed[episode] = False
        self.sim.wait(episodes, SETTLE)

    def mug(self, episode: int) -> np.ndarray:
        """Pose of the mug in the world, (4, 4). Privileged: for the expert, the collision world and the judge."""
        qpos = self.sim.data[episode].qpos
        pose = np.eye(4)
        pose[:3, 3] = qpos[9:12]
        pose[:3, :3] = Rotation.from_quat(qpos[[13, 14, 15, 12]]).as_matrix()
        return pose

    def in_range(self, episode: int) -> bool:
        """Whether the settled mug lies inside the randomised range (a centimetre and 2 degrees of slack)."""
        mug = self.mug(episode)
        yaw = np.arctan2(mug[1, 2], mug[0, 2])
        inside = [
            low - slack <= value <= high + slack
            for value, (low, high), slack in (
                (mug[0, 3], RANGE.x, 0.01), (mug[1, 3], RANGE.y, 0.01), (yaw, RANGE.yaw, np.radians(2)),
            )
        ]  # fmt: skip
        return all(inside) and abs(mug[2, 2]) < 0.1

    def observe(self, episodes: Sequence[int]) -> Observation:
        """Renders the camera and reads joints and gripper mode."""
        if self._camera is None:
            self._camera = Camera(self.model, scene.IMAGE_HEIGHT, scene.IMAGE_WIDTH)
        images = [
            self._camera.render(self.sim.data[e], self._camera_name) for e in episodes
        ]
        q = np.array([self.sim.q(e) for e in episodes], np.float32)
        return Observation(
            np.array(images), q, self.closed[list(episodes)].astype(np.uint8)
        )

    def observe_at(self, episode: int, q: np.ndarray) -> Observation:
        """What the camera would see with the arm at `q` [rad]; a held mug moves along. Physics is not touched."""
        if self._camera is None:
            self._camera = Camera(self.model, scene.IMAGE_HEIGHT, scene.IMAGE_WIDTH)
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.sim.data[episode].qpos
        data.qpos[:7] = q
        mujoco.mj_kinematics(self.model, data)
        if self.held(episode):
            hand = self.hand_pose(data)
            mug = (
                hand
                @ np.linalg.inv(self.hand_pose(self.sim.data[episode]))
                @ self.mug(episode)
            )
            data.qpos[9:12] = mug[:3, 3]
            data.qpos[12:16] = Rotation.from_matrix(mug[:3, :3]).as_quat()[[3, 0, 1, 2]]
        mujoco.mj_forward(self.model, data)
        image = self._camera.render(data, self._camera_name)
        return Observation(
            image[None], np.float32(q)[None], self.closed[[episode]].astype(np.uint8)
        )

    def hand_pose(self, data: mujoco.MjData) -> np.ndarray:
        """Pose of the hand's frame in the world, (4, 4)."""
        pose = np.eye(4)
        pose[:3, 3] = data.body("hand").xpos
        pose[:3, :3] = data.body("hand").xmat.reshape(3, 3)
        return pose

    def pads_touching(self, episode: int) -> int:
        """How many of the two pads touch the mug."""
        touching = set()
        for contact in self.sim.data[episode].contact:
            for pad, other in (contact.geom, contact.geom[::-1]):
                if (
                    pad in self._pads
                    and self.model.geom_bodyid[other] == self._mug_body
                ):
                    touching.add(pad)
        return len(touching)

    def held(self, episode: int) -> bool:
        """Whether the closed gripper has the mug between both pads."""
        return bool(self.closed[episode]) and self.pads_touching(episode) == 2

    def follow(
        self, episodes: Sequence[int], trajectories: Sequence[np.ndarray]
    ) -> None:
        """Executes timed trajectories."""
        self.sim.follow(episodes, trajectories)

    def toggle(self, episodes: Sequence[int], close: Sequence[bool]) -> None:
        """Toggles grippers once, ramped."""
        self.sim.close([e for e, c in zip(episodes, close, strict=True) if c])
        self.sim.open([e for e, c in zip(episodes, close, strict=True) if not c])
        self.closed[list(episodes)] = close

    def widen(self, episodes: Sequence[int]) -> None:
        """Opens the fingers of released grippers all the way, once the hand is away."""
        self.sim.open([e for e in episodes if not self.closed[e]], wide=True)

    def wait(self, episodes: Sequence[int], seconds: float) -> None:
        """Lets time pass."""
        self.sim.wait(episodes, seconds)

    def arrived(self, episode: int, q: np.ndarray, tolerance: float = 0.03) -> bool:
        """Whether every joint is within `tolerance` of `q` [rad]."""
        return bool(np.abs(self.sim.q(episode) - q).max() < tolerance)

    def retreat(self, episode: int) -> np.ndarray:
        """Joints [rad] of a hand that has backed off along its own axis; from the joints alone."""
        return self._kinematics.retreat(self.sim.q(episode), RETREAT)

    def worlds(self, touching: np.ndarray) -> World:
        """What planning may know of each episode: the mug's place, how it is held, allowed contacts.

        Args:
            touching: (batch,) phases that end in a toggle or begin after one: there the held mug
                may meet or leave table and box, and an open hand the mug.
        """
        worlds = [self._world(e, bool(touching[e])) for e in range(self.batch)]
        return jax.tree.map(lambda *leaves: np.stack(leaves), *worlds)

    def _world(self, episode: int, touching: bool) -> World:
        data, mug, held = self.sim.data[episode], self.mug(episode), self.held(episode)
        if held:
            mug = np.linalg.inv(self.hand_pose(data)) @ mug
        pose = np.concatenate(
            [mug[:3, 3], Rotation.from_matrix(mug[:3, :3]).as_quat()[[3, 0, 1, 2]]]
        )
        ignored = self._allowed["held" if held else "free", touching]
        return World(
            np.float32(pose[None]),
            np.array([held]),
            np.float32(data.qpos[7:9].clip(0, 0.04)),
            ignored,
        )

    def in_terminal_region(self, episode: int) -> bool:
        """Q_term: gripper open, tool centre point low over the target box. Known from the joints alone."""
        tcp = self.sim.data[episode].site("tcp").xpos
        inside = np.all(
            np.abs(tcp[:2] - scene.BOX_POSITION[:2]) < scene.BOX_INNER + 0.02
        )
        return bool(not self.closed[episode] and inside and tcp[2] < 0.12)

    def failure(self, episode: int) -> str | None:
        """Why the finished episode is no success; None if the mug stands in the box, at rest and let go."""
        mug, data = self.mug(episode), self.sim.data[episode]
        checks = {
            "the mug is outside the box": np.any(
                np.abs((mug[:3, 3] - scene.BOX_POSITION)[:2]) > scene.BOX_INNER
            ),
            "the mug is not upright": mug[2, 2] < np.cos(np.radians(20)),
            "the mug is not at rest": np.linalg.norm(data.qvel[9:12]) > 0.01,
            "the gripper is closed": self.closed[episode],
            "the hand is not clear": self.pads_touching(episode) > 0
            or np.linalg.norm(data.site("tcp").xpos - mug[:3, 3]) < 0.05,
        }
        return next((reason for reason, failed in checks.items() if failed), None)


def allowed_contacts() -> dict[tuple[str, bool], list[str]]:
    """Contacts that a phase allows, by (how the mug is, whether the phase begins or ends at a toggle)."""
    pads = ["left_finger|mug", "right_finger|mug"]
    hand = [*pads, "hand|mug"]
    ground = ["mug|world", "box|mug"]
    return {
        ("free", False): ground,
        ("free", True): [*ground, *pads],
        ("held", False): hand,
        ("held", True): [*hand, *ground],
    }


def sample_pose(
    seed: int, shape: MugShape = MugShape()
) -> tuple[np.ndarray, np.ndarray]:
    """Position [m] and rotation matrix from which the mug of a seed is dropped."""
    rng = np.random.default_rng(seed)
    x, y, yaw = rng.uniform(*np.array([RANGE.x, RANGE.y, RANGE.yaw]).T)
    right = bool(rng.integers(2))
    pitch, off = rng.uniform(-RANGE.pitch, RANGE.pitch), rng.uniform(0, RANGE.roll)
    # At rest the handle's tip touches the table: this far below the horizontal, on either side.
    rest = np.arcsin(shape.radius / shape.handle_reach)
    angle = np.pi + rest - off if right else -rest + off
    axis = np.array(
        [np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
    )
    side = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    handle = np.cos(angle) * side + np.sin(angle) * np.cross(axis, side)
    rotation = np.stack([handle, np.cross(axis, handle), axis], 1)
    return np.array([x, y, shape.radius + RANGE.drop]), rotation

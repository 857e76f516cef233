"""The mug task as physics sees it: reset, observe, move, toggle, judge. A batch of episodes."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import mujoco
import numpy as np

from jaxplan.collision import World
from jaxplan.scene import Scene
from jaxplan.simulation.camera import Camera
from jaxplan.simulation.physics import Simulator
from jaxplan.tasks.mug import judge, poses, scene
from jaxplan.tasks.mug.kinematics import RETREAT, InverseKinematics
from jaxplan.tasks.mug.mug import MugShape

SETTLE = 0.8
"""Time to come to rest after the drop [s]."""
MET = 0.001
"""Fingers nearer than this to the middle hold nothing: half of the mug's wall is 2 mm [m]."""
FINGERS, MUG = slice(7, 9), slice(9, 16)
"""Where qpos holds the fingers [m] and the mug's position and quaternion."""


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
        friction: Factor on all friction; 0 shows that grasps hold by friction alone.
        shape: Sizes of the mug.
        variant: `plain`, or `cluttered` with obstacles across most straight lines.

    Raises:
        ValueError: There is no such variant.
    """

    def __init__(
        self,
        batch: int,
        camera: str = "hand",
        friction: float = 1.0,
        shape: MugShape = MugShape(),
        variant: scene.Variant = "plain",
    ) -> None:
        model = scene.build("physics", shape, variant)
        model.geom_friction *= friction
        self.model, self.shape, self.batch = model, shape, batch
        self.variant: scene.Variant = variant
        self.name = scene.task_name(variant)
        self.sim = Simulator(model, batch)
        self.closed = np.zeros(batch, bool)
        self._camera_name = camera
        self._camera: Camera | None = None
        self._pads = {model.geom("left_pad").id, model.geom("right_pad").id}
        self._mug_body = model.body("mug").id
        self._kinematics = InverseKinematics(model)
        self.planning_scene = Scene.from_mjcf(scene.build("planning", shape, variant))
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
            mug = np.eye(4)
            mug[:3, 3], mug[:3, :3] = poses.sample_pose(seed, self.shape)
            data.qpos[MUG] = poses.from_matrix(mug)
            self.closed[episode] = False
        self.sim.wait(episodes, SETTLE)

    def mug(self, episode: int) -> np.ndarray:
        """Pose of the mug in the world, (4, 4).

        Privileged: for the expert, the collision world and the judge.
        """
        return poses.to_matrix(self.sim.data[episode].qpos[MUG])

    def in_range(self, episode: int) -> bool:
        """Whether the settled mug lies inside the randomised range, with a little slack."""
        return poses.in_range(self.mug(episode))

    def observe(self, episodes: Sequence[int]) -> Observation:
        """Renders the camera and reads joints and gripper mode."""
        images = [self._render(self.sim.data[e]) for e in episodes]
        q = np.array([self.sim.q(e) for e in episodes], np.float32)
        return Observation(np.array(images), q, self._gripper(episodes))

    def observe_at(self, episode: int, q: np.ndarray) -> Observation:
        """What the camera would see with the arm at `q` [rad]; a held mug moves along.

        Physics is not touched.
        """
        present, data = self.sim.data[episode], mujoco.MjData(self.model)
        data.qpos[:] = present.qpos
        data.qpos[:7] = q
        mujoco.mj_kinematics(self.model, data)
        if self.held(episode):
            in_hand = np.linalg.inv(self.hand_pose(present))
            mug = self.hand_pose(data) @ in_hand @ self.mug(episode)
            data.qpos[MUG] = poses.from_matrix(mug)
        mujoco.mj_forward(self.model, data)
        image = self._render(data)
        return Observation(
            image[None], np.asarray(q, np.float32)[None], self._gripper([episode])
        )

    def hand_pose(self, data: mujoco.MjData) -> np.ndarray:
        """Pose of the hand's frame in the world, (4, 4)."""
        pose = np.eye(4)
        pose[:3, 3] = data.body("hand").xpos
        pose[:3, :3] = data.body("hand").xmat.reshape(3, 3)
        return pose

    def pads_touching(self, episode: int) -> int:
        """How many of the two pads touch the mug."""
        body = self.model.geom_bodyid
        return len(
            {
                pad
                for contact in self.sim.data[episode].contact
                for pad, other in (contact.geom, contact.geom[::-1])
                if pad in self._pads and body[other] == self._mug_body
            }
        )

    def held(self, episode: int) -> bool:
        """Whether the closed gripper has the mug between both pads."""
        return bool(self.closed[episode]) and self.pads_touching(episode) == 2

    def empty_handed(self, episode: int) -> bool:
        """Whether the closed gripper's fingers have met. Known from the fingers alone."""
        return bool(self.closed[episode] and self.sim.fingers(episode).max() < MET)

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
        """Joints [rad] of a hand that has backed off along its own axis.

        From the joints alone.
        """
        return self._kinematics.retreat(self.sim.q(episode), RETREAT)

    def worlds(self, touching: np.ndarray) -> World:
        """What planning may know of each episode: the mug, how it is held, allowed contacts.

        Args:
            touching: (batch,) phases that end in a toggle or begin after one: there the held mug
                may meet or leave table and box, and an open hand the mug.
        """
        rows = [self._world(e, bool(touching[e])) for e in range(self.batch)]
        leaves = (jnp.asarray(np.stack(leaf)) for leaf in zip(*rows, strict=True))
        return World(*leaves)

    def in_terminal_region(self, episode: int) -> bool:
        """Q_term: the open hand is low over the target box. Known from the joints alone."""
        tcp = self.sim.data[episode].site("tcp").xpos
        return judge.in_terminal_region(tcp, self.closed[episode])

    def failure(self, episode: int) -> str | None:
        """Why the finished episode is no success.

        None if the mug stands in the box, at rest and let go.
        """
        data = self.sim.data[episode]
        return judge.failure(
            self.mug(episode),
            float(np.linalg.norm(data.qvel[9:12])),
            data.site("tcp").xpos,
            self.closed[episode],
            self.pads_touching(episode) > 0,
        )

    def _render(self, data: mujoco.MjData) -> np.ndarray:
        if self._camera is None:
            self._camera = Camera(self.model, scene.IMAGE_HEIGHT, scene.IMAGE_WIDTH)
        return self._camera.render(data, self._camera_name)

    def _gripper(self, episodes: Sequence[int]) -> np.ndarray:
        return self.closed[list(episodes)].astype(np.uint8)

    def _world(self, episode: int, touching: bool) -> tuple[np.ndarray, ...]:
        """The leaves of an episode's `World`."""
        data, mug, held = self.sim.data[episode], self.mug(episode), self.held(episode)
        if held:
            mug = np.linalg.inv(self.hand_pose(data)) @ mug
        return (
            poses.from_matrix(mug)[None].astype(np.float32),
            np.array([held]),
            data.qpos[FINGERS].clip(0, 0.04).astype(np.float32),
            self._allowed["held" if held else "free", touching],
            np.zeros((0, 7), np.float32),
            np.zeros((0, 3), np.float32),
        )


def allowed_contacts() -> dict[tuple[str, bool], list[str]]:
    """Contacts that a phase allows, by how the mug is and whether a toggle is near.

    Near: the phase begins after a toggle or ends in one.
    """
    pads = ["left_finger|mug", "right_finger|mug"]
    hand = [*pads, "hand|mug"]
    ground = ["mug|world", "box|mug"]
    return {
        ("free", False): ground,
        ("free", True): [*ground, *pads],
        ("held", False): hand,
        ("held", True): [*hand, *ground],
    }

"""Tasks of one arm over a table, as physics sees them: observe, execute, and what planning knows.

What is the same for all of them. A task says how an episode begins, where its objects are,
which contacts its phases allow, and what counts as success.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import mujoco
import numpy as np

from jaxplan.base import Action, Keyframes, Observation
from jaxplan.collision import World
from jaxplan.collision.obstacles import Obstacle
from jaxplan.config import PAPER_PLANNER
from jaxplan.motion import MotionPlanner
from jaxplan.robots import Robot
from jaxplan.robots.kinematics import InverseKinematics
from jaxplan.simulation.physics import Simulator
from jaxplan.tasks.execution import Execution
from jaxplan.tasks.eyes import Eyes
from jaxplan.tasks.perturbation import NOMINAL, Perturbation
from jaxplan.tasks.planned import Planned, stacked
from jaxplan.tasks.poses import from_matrix, to_matrix
from jaxplan.tasks.watch import Watch

ONE = "one"
"""Of objects: the same in all episodes."""
RETREAT = 0.10
"""How far the hand backs off along its own axis after a release [m]."""


def full_name(task: str, variant: str) -> str:
    """Of a task's variant, as demonstrations and weights have it."""
    return task if variant == "plain" else f"{task}_{variant}"


class Tabletop(ABC):
    """A batch of episodes in C MuJoCo, with one movable object.

    Args:
        name: As demonstrations and weights have it.
        robot: Whose arm moves.
        model: Of physics and pictures.
        planning: What collides, for the planner.
        allowed: Contacts that a phase allows, by how the object is (`free` or `held`) and
            whether a toggle is near.
        movable: Body of the object.
        batch: Number of episodes side by side.
        camera: Which one takes the pictures.
        image: Its rows and columns [px].
        perturbation: What varies in the pictures.
        look: Makes what perturbed ones are taken of, with the model's joints; the model itself
            where None.
        objects: Which objects episodes have: `ONE` for all, or each lane is given its own.
        zones: How many boxes an episode can have that the hand, and what it holds, keeps out of.

    Raises:
        ValueError: There is no such camera.
    """

    def __init__(
        self,
        name: str,
        robot: Robot,
        model: mujoco.MjModel,
        planning: mujoco.MjModel | mujoco.MjSpec,
        allowed: Mapping[tuple[str, bool], list[str]],
        movable: str,
        batch: int,
        camera: str,
        image: tuple[int, int],
        perturbation: Perturbation = NOMINAL,
        look: Callable[[], mujoco.MjModel] | None = None,
        objects: str = ONE,
        zones: int = 0,
    ) -> None:
        self.name, self.robot, self.model, self.batch = name, robot, model, batch
        self.camera = camera
        self.sim = Simulator(robot, model, batch)
        self._arms = Execution(self.sim, self.tcp, batch)
        self.closed = self._arms.closed
        shaped = [] if objects == ONE else [movable]
        self._planned = Planned(planning, robot, allowed, shaped, batch, zones)
        self.planning_scene, self.objects = self._planned.scene, objects
        self.kinematics = InverseKinematics(robot, model)
        look = look or (lambda: model)
        self.eyes = Eyes(model, look, camera, image, batch, perturbation)
        self._pads = {model.geom(pad).id for pad in robot.pads}
        self._body = model.body(movable).id
        start = int(model.jnt_qposadr[model.body_jntadr[self._body]])
        self.object_slice = slice(start, start + 7)
        """Where qpos holds the object's position and quaternion."""
        self._velocity = int(model.jnt_dofadr[model.body_jntadr[self._body]])

    def draw(self, objects: str) -> None:
        """Takes other objects from the next episodes on.

        Raises:
            ValueError: Lanes would need another planning scene.
        """
        if (objects == ONE) == bool(self.planning_scene.shaped):
            raise ValueError(
                f"objects {objects!r} in a task that was made with {self.objects!r}: "
                "make another"
            )
        self.objects = objects

    def expert_planner(self) -> MotionPlanner:
        """The planner of demonstrations, and of recorded problems."""
        config = replace(PAPER_PLANNER, p_uniform=1.0)
        return MotionPlanner(self.planning_scene, self.robot.limits, config)

    @property
    def zones(self) -> Mapping[str, Obstacle]:
        """Ways that an episode may close, by name, and the zone that closes each."""
        return {}

    def way(self, path: np.ndarray) -> str | None:
        """Which of `zones`' ways joints `path [T, d]` [rad] take, or None."""
        return None

    def watch(self) -> Watch:
        """Who tells failures by kind."""
        return Watch()

    @abstractmethod
    def reset(self, lanes: Sequence[int], seeds: Sequence[int]) -> None:
        """Starts an episode in each of some lanes; all about it comes from its seed."""

    @abstractmethod
    def unfit(self, lane: int) -> str | None:
        """Why an episode that has just begun cannot be asked of anybody, or None."""

    @abstractmethod
    def in_terminal_region(self, lane: int) -> bool:
        """Q_term, known from the joints alone."""

    @abstractmethod
    def failure(self, lane: int) -> str | None:
        """Why the finished episode is no success, or None."""

    @abstractmethod
    def keyframes(self, lane: int, q: np.ndarray) -> Keyframes:
        """The expert's way from joints `q` [rad] to the next toggle. Privileged."""

    def give(
        self,
        lane: int,
        model: mujoco.MjModel,
        look: Callable[[], mujoco.MjModel],
        geoms: Mapping[str, tuple[np.ndarray, np.ndarray]],
    ) -> None:
        """Gives a lane an object of its own, before an episode begins.

        Args:
            lane: Whose.
            model: Of physics, the task's but for the object.
            look: Makes what perturbed pictures are taken of.
            geoms: Place on the object and size [m] of what planning checks of it, by name.
        """
        # The near plane and the shadows are in units of the model's size.
        model.stat.extent = self.model.stat.extent
        model.stat.center[:] = self.model.stat.center
        self.sim.give(lane, model)
        self.eyes.give(lane, look)
        self._planned.give(lane, geoms)

    def begin(
        self, lane: int, seed: int, pose: np.ndarray, zones: Sequence[Obstacle] = ()
    ) -> None:
        """Arm at home, gripper open, the object at a pose `[4, 4]`, and zones to keep out of."""
        self.eyes.begin(lane, seed)
        self._planned.begin(lane, zones)
        data = self.sim.data[lane]
        mujoco.mj_resetDataKeyframe(data.model, data, 0)
        data.qpos[self.object_slice] = from_matrix(pose)
        self._arms.begin(lane)

    def object_pose(self, lane: int) -> np.ndarray:
        """Of the object in the world, `[4, 4]`.

        Privileged: for the expert, the collision world and the judge.
        """
        return to_matrix(self.sim.data[lane].qpos[self.object_slice])

    def object_speed(self, lane: int) -> float:
        """Of its centre [m/s]. Privileged, likewise."""
        first = self._velocity
        return float(np.linalg.norm(self.sim.data[lane].qvel[first : first + 3]))

    def observe(self, lanes: Sequence[int]) -> Observation:
        """Renders the camera and reads joints and gripper mode."""
        image = np.zeros((self.batch, *self.eyes.image, 3), np.uint8)
        q = np.zeros((self.batch, self.robot.dof), np.float32)
        gripper = np.zeros(self.batch, np.uint8)
        for e in lanes:
            image[e] = self.eyes.picture(e, self.sim.data[e])
            q[e], gripper[e] = self.sim.q(e), self.closed[e]
        return Observation({self.camera: image}, q, gripper)

    def observe_at(self, lane: int, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the camera would see with the arm at `q` [rad]; a held object moves along.

        Physics is not touched.

        Returns:
            The image, and `q` in single precision.
        """
        present = self.sim.data[lane]
        data = mujoco.MjData(present.model)
        data.qpos[:] = present.qpos
        data.qpos[self.robot.arm] = q
        mujoco.mj_kinematics(data.model, data)
        if self.held(lane):
            in_hand = np.linalg.inv(self.hand_pose(present))
            pose = self.hand_pose(data) @ in_hand @ self.object_pose(lane)
            data.qpos[self.object_slice] = from_matrix(pose)
        mujoco.mj_forward(data.model, data)
        return self.eyes.picture(lane, data), np.asarray(q, np.float32)

    def picture_of(self, lane: int, qpos: np.ndarray) -> np.ndarray:
        """What the camera sees of a state `[nq]` that the lane's episode has been in."""
        model = self.sim.data[lane].model
        data = mujoco.MjData(model)
        data.qpos[:] = qpos
        for step in mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_camlight:
            step(model, data)
        return self.eyes.picture(lane, data)

    def hand_pose(self, data: mujoco.MjData) -> np.ndarray:
        """Pose of the hand's frame in the world, `[4, 4]`."""
        pose, hand = np.eye(4), data.body(self.robot.hand)
        pose[:3, 3], pose[:3, :3] = hand.xpos, hand.xmat.reshape(3, 3)
        return pose

    def tcp(self, lane: int) -> np.ndarray:
        """The tool centre point, `[3]` [m]."""
        return self.sim.data[lane].site(self.robot.tcp).xpos

    def tcp_at(self, q: np.ndarray) -> np.ndarray:
        """Where joints `[d]` [rad] bring it, `[3]` [m]."""
        return self.kinematics.pose(q)[0]

    def pads_touching(self, lane: int) -> int:
        """How many of the two pads touch the object."""
        body = self.model.geom_bodyid
        return len(
            {
                pad
                for contact in self.sim.data[lane].contact
                for pad, other in (contact.geom, contact.geom[::-1])
                if pad in self._pads and body[other] == self._body
            }
        )

    def held(self, lane: int) -> bool:
        """Whether the closed gripper has the object between both pads."""
        return bool(self.closed[lane]) and self.pads_touching(lane) == 2

    def empty_handed(self, lane: int) -> bool:
        """Whether the closed gripper's fingers have met. Known from the fingers alone."""
        met = self.sim.fingers(lane).max() < self.robot.gripper.met
        return bool(self.closed[lane] and met)

    def retreat(self, lane: int) -> np.ndarray:
        """Joints [rad] of a hand that has backed off along its own axis.

        From the joints alone.
        """
        return self.kinematics.retreat(self.sim.q(lane), RETREAT)

    def execute(self, lanes: Sequence[int], action: Action) -> np.ndarray:
        """Moves and toggles; `[B]` bool, which toggled."""
        return self._arms.execute(lanes, action)

    def wait(self, lanes: Sequence[int], seconds: float) -> None:
        """Lets time pass."""
        self.sim.map(lambda e: self.sim.wait(e, seconds), lanes)

    def worlds(self, touching: np.ndarray) -> World:
        """What planning may know of each episode: the object, how it is held, allowed contacts.

        Args:
            touching: `[B]` phases that end in a toggle or begin after one: there the held
                object may meet or leave what it stands on, and an open hand the object.
        """
        return stacked([self._world(e, bool(touching[e])) for e in range(self.batch)])

    def _world(self, lane: int, touching: bool) -> tuple[np.ndarray, ...]:
        """The leaves of an episode's `World`."""
        data, pose, held = self.sim.data[lane], self.object_pose(lane), self.held(lane)
        if held:
            pose = np.linalg.inv(self.hand_pose(data)) @ pose
        return self._planned.leaves(lane, pose, held, touching, data.qpos)

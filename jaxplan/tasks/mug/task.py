"""The mug task: reset, keyframes, what phases allow, and the judge."""

from collections.abc import Sequence
from functools import partial

import mujoco
import numpy as np

from jaxplan.base import Keyframes
from jaxplan.collision.obstacles import Obstacle
from jaxplan.motion import MotionPlanner
from jaxplan.robots import PANDA
from jaxplan.tasks.mug import judge, mugs, poses, scene
from jaxplan.tasks.mug.demonstrated import expert_planner
from jaxplan.tasks.mug.expert import Expert
from jaxplan.tasks.mug.mug import MugShape, planning_geoms
from jaxplan.tasks.mug.watch import MugWatch
from jaxplan.tasks.mug.ways import closed_way, way_of
from jaxplan.tasks.perturbation import NOMINAL, Perturbation
from jaxplan.tasks.tabletop import ONE, Tabletop, full_name

SETTLE = 0.8
"""Time to come to rest after the drop [s]."""


class MugTask(Tabletop):
    """A batch of mug episodes in C MuJoCo.

    Args:
        batch: Number of episodes side by side.
        camera: `hand` or `static`.
        friction: Factor on all friction; 0 shows that grasps hold by friction alone.
        variant: One of `scene.VARIANTS`.
        perturbation: What varies in the pictures.
        objects: Which mugs there are: the same one, or those of `mugs.RANGES`.

    Raises:
        ValueError: There is no such variant.
    """

    def __init__(
        self,
        batch: int,
        camera: str = "hand",
        friction: float = 1.0,
        variant: str = "plain",
        perturbation: Perturbation = NOMINAL,
        objects: str = ONE,
    ) -> None:
        self.variant, self._friction = variant, friction
        self._layout = scene.VARIANTS[variant]
        self._box = np.array(self._layout.box)
        super().__init__(
            full_name("mug", variant),
            PANDA,
            self._physics(MugShape()),
            scene.spec("planning", variant=variant),
            allowed_contacts(),
            "mug",
            batch,
            camera,
            (scene.IMAGE_HEIGHT, scene.IMAGE_WIDTH),
            perturbation,
            partial(scene.look, variant=variant),
            objects,
            zones=1 if self._layout.zones else 0,
        )
        self.shapes = [MugShape()] * batch
        """The lanes' mugs. Privileged."""

    def expert_planner(self) -> MotionPlanner:
        """The planner of demonstrations, and of recorded problems."""
        return expert_planner(self.planning_scene, self._layout)

    @property
    def zones(self) -> dict[str, Obstacle]:
        """Of the variant."""
        return {name: zone.obstacle for name, zone in self._layout.zones.items()}

    def way(self, path: np.ndarray) -> str | None:
        """Past the post, if there is one."""
        return way_of(np.array([self.tcp_at(q) for q in path])) if self.zones else None

    def watch(self) -> MugWatch:
        """Who tells failures by kind."""
        return MugWatch(self)

    def reset(self, lanes: Sequence[int], seeds: Sequence[int]) -> None:
        """Starts episodes: arm at home, gripper open, mug dropped and come to rest.

        The result depends on the seed alone, bit for bit. Nothing asks whether the pose is easy.
        """
        for lane, seed in zip(lanes, seeds, strict=True):
            if self.objects != ONE:
                self._take(lane, mugs.mug_of(self.objects, seed))
            pose = np.eye(4)
            pose[:3, 3], pose[:3, :3] = poses.sample_pose(seed, self.shapes[lane])
            self.begin(lane, seed, pose, self._zones(seed))
        self.wait(lanes, SETTLE)

    def unfit(self, lane: int) -> str | None:
        """None if the settled mug lies inside the randomised range, with a little slack."""
        if poses.in_range(self.object_pose(lane)):
            return None
        return "the mug came to rest outside the range"

    def keyframes(self, lane: int, q: np.ndarray) -> Keyframes:
        """The expert's way to the next toggle. Privileged."""
        expert = Expert(self.kinematics, self.shapes[lane], self._box)
        closed = bool(self.closed[lane])
        return expert.keyframes(self.object_pose(lane), q.astype(float), closed)

    def in_terminal_region(self, lane: int) -> bool:
        """Q_term: the open hand is low over the target box. Known from the joints alone."""
        return judge.in_terminal_region(self.tcp(lane), self.closed[lane], self._box)

    def failure(self, lane: int) -> str | None:
        """Why the finished episode is no success.

        None if the mug stands in the box, at rest and let go.
        """
        return judge.failure(
            self.object_pose(lane),
            self.object_speed(lane),
            self.tcp(lane),
            self.closed[lane],
            self.pads_touching(lane) > 0,
            self._box,
        )

    def _zones(self, seed: int) -> list[Obstacle]:
        """The zone that closes an episode's way, if one does."""
        closed = closed_way(seed, self.zones)
        return [] if closed is None else [self.zones[closed]]

    def _take(self, lane: int, shape: MugShape) -> None:
        """Another mug for a lane."""
        look = partial(scene.look, shape, self.variant)
        self.give(lane, self._physics(shape), look, planning_geoms(shape))
        self.shapes[lane] = shape

    def _physics(self, shape: MugShape) -> mujoco.MjModel:
        model = scene.build("physics", shape, self.variant)
        model.geom_friction *= self._friction
        return model


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

"""Moments of an episode drawn for people: the scene, what was predicted, what was proposed."""

from typing import NamedTuple

import mujoco
import numpy as np
from PIL import Image

from jaxplan.planning import Segment
from jaxplan.simulation.camera import Camera, Mark
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.kinematics import InverseKinematics
from jaxplan.tasks.mug.task import MugTask

HEIGHT, WIDTH = 480, 640
INSET = (204, 132)
"""Size of what the hand's camera saw, in a picture's corner [px]."""

Rgba = tuple[float, float, float, float]
PROPOSAL: Rgba = (0.10, 0.35, 1.0, 0.45)
SUBGOAL: Rgba = (0.05, 0.10, 0.70, 1.0)
CLOSES: Rgba = (0.10, 0.75, 0.20, 1.0)
OPENS: Rgba = (0.90, 0.10, 0.80, 1.0)
"""Of learned proposals, the subgoal, and toggles that close or open: the paper's Figure 2."""


class Moment(NamedTuple):
    """An episode at the start of a phase, or after its last."""

    qpos: np.ndarray
    seen: np.ndarray | None = None
    """(88, 136, 3) uint8, by the hand's camera."""
    targets: tuple[Mark, ...] = ()
    """The toggle and the subgoal."""
    proposals: tuple[Mark, ...] = ()


class Painter:
    """Draws moments of a task's episodes.

    Args:
        task: Whose scene it is.
        view: Where the picture is taken from: `static` shows the robot, `near` the hand at work.
    """

    def __init__(self, task: MugTask, view: str = "static") -> None:
        model = scene.build("physics", task.shape, task.variant)
        model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
        self._view = view if view == "static" else _near()
        self._camera = Camera(model, HEIGHT, WIDTH)
        self._model, self._data = model, mujoco.MjData(model)
        self._kinematics = InverseKinematics(model)

    def moment(self, phase, episode: int, qpos: np.ndarray) -> Moment:
        """An episode at the start of a `rollout.Phase`, without proposals."""
        row, targets = phase.episodes.index(episode), phase.targets
        toggle = CLOSES if targets.gripper_toggle[row] else OPENS
        marks = (
            self._mark(targets.q_toggle[row], 0.012, toggle),
            Mark(self.tcp(targets.q_goal[row]), 0.024, SUBGOAL, "cross"),
        )
        return Moment(qpos.copy(), phase.observation.image[row], marks)

    def proposed(
        self,
        phase,
        episode: int,
        segments: Segment,
        bases: int = 4,
        each: int = 12,
    ) -> np.ndarray:
        """Nodes that a tree would try along the path that a phase's search found.

        Args:
            phase: A `rollout.Phase`.
            episode: Its lane.
            segments: Learned segments of all lanes, direction (B, M, 7) and length (B, M).
            bases: From how many of the path's nodes, evenly and the goal left out.
            each: How many segments from each.

        Returns:
            Configurations (bases * each, 7) [rad].
        """
        result = phase.motion.result
        length = max(1, int(result.path_length[episode]))
        at = np.linspace(0, length - 1, bases, endpoint=False).astype(int)
        direction = np.asarray(segments.direction[episode])[:each]
        step = np.asarray(segments.length[episode])[:each, None]
        nodes = result.path[episode, at, None] + direction * step
        return nodes.reshape(-1, 7).clip(*self._model.jnt_range[:7].T)

    def dots(self, nodes: np.ndarray, radius: float = 0.004) -> tuple[Mark, ...]:
        """Where proposed nodes (N, 7) [rad] bring the tool centre point."""
        return tuple(self._mark(q, radius, PROPOSAL) for q in nodes)

    def picture(self, moment: Moment) -> Image.Image:
        """Renders a moment, with what the hand's camera saw in its corner."""
        self._data.qpos[:] = moment.qpos
        mujoco.mj_forward(self._model, self._data)
        marks = (*moment.proposals, *moment.targets)
        picture = Image.fromarray(self._camera.render(self._data, self._view, marks))
        if moment.seen is not None:
            seen = Image.fromarray(moment.seen).resize(INSET)
            picture.paste(seen, (WIDTH - INSET[0], 0))
        return picture

    def tcp(self, q: np.ndarray) -> np.ndarray:
        """The tool centre point (3,) of joints (7,) [rad]."""
        return self._kinematics.pose(q)[0]

    def _mark(self, q: np.ndarray, radius: float, rgba: Rgba) -> Mark:
        return Mark(self.tcp(q), radius, rgba)


def _near() -> mujoco.MjvCamera:
    """A view of the table's middle, the box and the hand above them."""
    view = mujoco.MjvCamera()
    view.lookat[:] = 0.42, -0.08, 0.16
    view.distance, view.azimuth, view.elevation = 1.05, 150.0, -30.0
    return view

"""Moments of an episode drawn for people: the scene, what was predicted, what was proposed."""

import copy
from typing import NamedTuple

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from PIL import Image, ImageDraw

from jaxplan.base import Phase
from jaxplan.planning import DrawBank, Segment
from jaxplan.robots.kinematics import InverseKinematics
from jaxplan.simulation.camera import Camera
from jaxplan.tasks import Tabletop

HEIGHT, WIDTH = 480, 640
INSET = 0.3
"""Width of what the hand's camera saw, as a share of the picture's."""

Color = tuple[int, int, int]
PROPOSAL: Color = (40, 150, 255)
SUBGOAL: Color = (10, 20, 140)
CLOSES: Color = (0, 175, 50)
OPENS: Color = (235, 20, 200)
MARKS = PROPOSAL, SUBGOAL, CLOSES, OPENS
"""Of learned proposals, the subgoal, and toggles that close or open: the paper's Figure 2."""


class Mark(NamedTuple):
    """Something drawn over a picture, in sight even where it lies behind the hand."""

    position: np.ndarray
    """`[3]` [m]."""
    shape: str
    """dot, disc or cross."""
    color: Color


VIEWS = {
    "near": ((0.42, -0.10, 0.23), 1.15, -28.0),
    "above": ((0.45, -0.20, 0.15), 1.35, -72.0),
}
"""Where they look, from how far, and how steeply."""


class Moment(NamedTuple):
    """An episode at the start of a phase, or after its last."""

    model: mujoco.MjModel
    """Of its lane, whose object may be like no other's."""
    qpos: np.ndarray
    seen: np.ndarray | None = None
    """`[H, W, 3]` uint8, by the task's camera."""
    targets: tuple[Mark, ...] = ()
    """The toggle and the subgoal."""
    proposals: tuple[Mark, ...] = ()


class Painter:
    """Draws moments of a task's episodes.

    Args:
        task: Whose scene it is.
        view: Where from: `static` shows the whole robot, `near` the hand at work, `above` the ways
            past what stands on the table.
        scale: Of the picture's sides, 1 for `WIDTH` by `HEIGHT`, at most 2.
    """

    def __init__(self, task: Tabletop, view: str = "static", scale: int = 1) -> None:
        model = copy.copy(task.model)
        model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
        self._view = _view(*VIEWS[view]) if view in VIEWS else view
        self._scale = scale
        self._camera = Camera(model, scale * HEIGHT, scale * WIDTH)
        self._task = task
        self._limits = model.jnt_range[task.robot.arm].T
        self._kinematics = InverseKinematics(task.robot, model)

    def now(self, lane: int) -> Moment:
        """A lane as it is."""
        data = self._task.sim.data[lane]
        return Moment(data.model, data.qpos.copy())

    def moment(self, phase: Phase, lane: int) -> Moment:
        """A lane at the start of a phase of Algorithm 1, without proposals."""
        subgoal = phase.action.decision.subgoal
        toggle = CLOSES if subgoal.gripper_toggle[lane] else OPENS
        marks = (
            Mark(self.tcp(subgoal.q_toggle[lane]), "disc", toggle),
            Mark(self.tcp(subgoal.q_goal[lane]), "cross", SUBGOAL),
        )
        seen = phase.observation.images[self._task.camera][lane]
        return self.now(lane)._replace(seen=seen, targets=marks)

    def proposed(
        self,
        phase: Phase,
        lane: int,
        draw: DrawBank,
        count: int = 48,
    ) -> np.ndarray:
        """Where a tree would go by learned segments.

        To their ends; those that do not say where they begin, from nodes along the path that
        the phase's search found.

        Args:
            phase: Of Algorithm 1.
            lane: Of it.
            draw: Banks of all lanes.
            count: N, how many segments.

        Returns:
            Configurations `[N, d]` [rad].
        """
        motion = phase.action.decision.motion
        lanes, banks, drawn = len(motion.q), [], 0
        while drawn < count:
            banks.append(draw(jnp.full(lanes, len(banks), jnp.int32)))
            drawn += banks[-1].length.shape[1]
        segment: Segment = jax.tree.map(
            lambda *leaves: np.concatenate([x[lane] for x in leaves])[:count], *banks
        )
        if segment.base is None:
            result = motion.result
            length = max(1, int(result.path_length[lane]))
            at = np.linspace(0, length - 1, count, endpoint=False).astype(int)
            segment = segment._replace(base=result.path[lane, at])
        return np.asarray(segment.end).clip(*self._limits)

    def dots(self, nodes: np.ndarray) -> tuple[Mark, ...]:
        """Where proposed nodes `[N, d]` [rad] bring the tool centre point."""
        return tuple(Mark(self.tcp(q), "dot", PROPOSAL) for q in nodes)

    def picture(self, moment: Moment, around: np.ndarray | None = None) -> Image.Image:
        """Renders a moment, with what the hand's camera saw in its lower right corner.

        Args:
            moment: What is drawn.
            around: Points `[N, 3]` [m]; only the part of the picture about them is shown.
        """
        data = mujoco.MjData(moment.model)
        data.qpos[:] = moment.qpos
        mujoco.mj_forward(moment.model, data)
        picture = Image.fromarray(self._camera.render(data, self._view))
        marks = (*moment.proposals, *moment.targets)
        if marks:
            places = self._camera.project(np.array([m.position for m in marks]))
            picture = marked(picture, marks, places, self._scale)
        if around is not None:
            picture = picture.crop(_window(self._camera.project(around), picture.size))
        if moment.seen is not None:
            width = round(INSET * picture.width)
            height = width * moment.seen.shape[0] // moment.seen.shape[1]
            seen = Image.fromarray(moment.seen).resize((width, height))
            picture.paste(seen, (picture.width - width, picture.height - height))
        return picture

    def tcp(self, q: np.ndarray) -> np.ndarray:
        """The tool centre point `[3]` of joints `[d]` [rad]."""
        return self._kinematics.pose(q)[0]


def marked(
    picture: Image.Image, marks: tuple[Mark, ...], places: np.ndarray, scale: int
) -> Image.Image:
    """The picture with marks at pixels `[N, 2]`; dots let through what is below."""
    over = Image.new("RGBA", picture.size)
    draw = ImageDraw.Draw(over)
    for mark, (x, y) in zip(marks, places, strict=True):
        if mark.shape == "dot":
            r = 3 * scale
            box = (x - r, y - r, x + r, y + r)
            draw.ellipse(box, (*mark.color, 150), (0, 50, 140, 200))
        elif mark.shape == "disc":
            r = 7 * scale
            box = (x - r, y - r, x + r, y + r)
            draw.ellipse(box, (*mark.color, 230), (255, 255, 255, 255), 2 * scale)
        else:
            for color, r, width in (((255, 255, 255), 12, 6), (mark.color, 11, 3)):
                r, width = r * scale, width * scale
                draw.line((x - r, y, x + r, y), (*color, 255), width)
                draw.line((x, y - r, x, y + r), (*color, 255), width)
    return Image.alpha_composite(picture.convert("RGBA"), over).convert("RGB")


def _window(places: np.ndarray, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, top, right and bottom of the part about pixels `[N, 2]`, in the picture's shape."""
    low, high = places.min(0), places.max(0)
    room = np.maximum(0.12 * np.array(size), 0.3 * (high - low))
    share = max(0.4, *((high - low + 2 * room) / size))
    half = min(share, 1.0) * np.array(size) / 2
    middle = np.clip((low + high) / 2, half, size - half)
    left, top = (middle - half).round().astype(int)
    right, bottom = (middle + half).round().astype(int)
    return int(left), int(top), int(right), int(bottom)


def _view(
    lookat: tuple[float, float, float], distance: float, elevation: float
) -> mujoco.MjvCamera:
    """From the robot's left [m, degrees]."""
    view = mujoco.MjvCamera()
    view.lookat[:] = lookat
    view.distance, view.azimuth, view.elevation = distance, 125.0, elevation
    return view

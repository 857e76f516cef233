"""Pictures of an episode for people: a film strip with a panel per phase, and a video."""

from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from PIL import Image, ImageDraw

from jaxplan.simulation.camera import Camera, Mark
from jaxplan.simulation.physics import CONTROL_PERIOD
from jaxplan.simulation.video import write_video
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.kinematics import InverseKinematics
from jaxplan.tasks.mug.task import MugTask

VIDEO_EVERY = 6
"""Control periods between video frames."""
VIDEO_FPS = 1 / (VIDEO_EVERY * CONTROL_PERIOD)
HEIGHT, WIDTH = 480, 640
INSET = (204, 132)
"""Size of what the hand's camera saw, in a panel's corner [px]."""
COLUMNS = 5
BLUE = (0.15, 0.4, 1.0, 0.45)
GREEN = (0.1, 0.8, 0.2, 1.0)
MAGENTA = (0.9, 0.1, 0.8, 1.0)
ORANGE = (1.0, 0.55, 0.0, 1.0)


class _Panel(NamedTuple):
    qpos: np.ndarray
    marks: list[Mark]
    seen: np.ndarray
    title: str


class Film:
    """Keeps what the pictures of a task's first episode need, and makes them afterwards."""

    def __init__(self, task: MugTask) -> None:
        self._task = task
        self._kinematics = InverseKinematics(task.model)
        self._states: list[np.ndarray] = []
        self._panels: list[_Panel] = []
        self._ticks = 0
        task.sim.record = self._record

    def add_phase(self, phase) -> None:
        """A panel: the scene at the start of a `rollout.Phase`, targets and proposals drawn in."""
        targets = phase.targets
        marks = [] if phase.segments is None else self._proposals(phase)
        toggle = MAGENTA if targets.gripper_toggle[0] == 0 else GREEN
        marks.append(self._mark(targets.q_toggle[0], 0.012, toggle))
        marks.append(self._mark(targets.q_goal[0], 0.009, ORANGE))
        seen, title = phase.observation.image[0], f"{phase.number + 1}"
        qpos = self._task.sim.data[0].qpos.copy()
        self._panels.append(_Panel(qpos, marks, seen, title))

    def write(self, directory: Path) -> None:
        """Renders `phases.png` and `episode.mp4` into a directory."""
        model = scene.build("physics", self._task.shape)
        model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
        camera = Camera(model, HEIGHT, WIDTH)
        data = mujoco.MjData(model)

        def picture(qpos: np.ndarray, marks: list[Mark]) -> np.ndarray:
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            return camera.render(data, "static", marks)

        panels = []
        for qpos, marks, seen, title in self._panels:
            panel = Image.fromarray(picture(qpos, marks))
            panel.paste(Image.fromarray(seen).resize(INSET), (WIDTH - INSET[0], 0))
            ImageDraw.Draw(panel).text((8, 8), title, fill=(20, 20, 20), font_size=24)
            panels.append(np.asarray(panel))
        panels.append(picture(self._states[-1], []))
        _strip(panels).save(directory / "phases.png")
        frames = (picture(qpos, []) for qpos in self._states)
        write_video(directory / "episode.mp4", frames, round(VIDEO_FPS))

    def _record(self, episode: int, data: mujoco.MjData) -> None:
        self._ticks += 1
        if self._ticks % VIDEO_EVERY == 0:
            self._states.append(data.qpos.copy())

    def _proposals(self, phase) -> list[Mark]:
        """Where learned segments end, begun along the way as the tree will begin them."""
        length = max(1, int(phase.motion.result.path_length[0]))
        nodes = phase.motion.result.path[0, :length]
        nodes = nodes[:: max(1, length // 4)]
        direction = np.asarray(phase.segments.direction[0])[:12]
        step = np.asarray(phase.segments.length[0])[:12, None]
        ends = nodes[:, None] + direction * step
        return [self._mark(q, 0.004, BLUE) for q in ends.reshape(-1, ends.shape[-1])]

    def _mark(
        self, q: np.ndarray, radius: float, rgba: tuple[float, float, float, float]
    ) -> Mark:
        return Mark(self._kinematics.pose(q)[0], radius, rgba)


def _strip(panels: list[np.ndarray]) -> Image.Image:
    """Panels in rows of `COLUMNS`, at half size."""
    blank = [np.full_like(panels[0], 255)] * (-len(panels) % COLUMNS)
    panels = [*panels, *blank]
    rows = [
        np.concatenate(panels[k : k + COLUMNS], 1)
        for k in range(0, len(panels), COLUMNS)
    ]
    strip = Image.fromarray(np.concatenate(rows))
    half = strip.width // 2, strip.height // 2
    return strip.resize(half, Image.Resampling.LANCZOS)

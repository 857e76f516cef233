"""Pictures of an episode for people: a film strip with a panel per phase, and a video."""

from pathlib import Path

import mujoco
import numpy as np
from PIL import Image, ImageDraw

from jaxplan.base import Phase
from jaxplan.pictures.painter import Moment, Painter
from jaxplan.simulation.physics import CONTROL_PERIOD
from jaxplan.simulation.video import write_video
from jaxplan.tasks import Tabletop

VIDEO_EVERY = 6
"""Control periods between video frames."""
VIDEO_FPS = 1 / (VIDEO_EVERY * CONTROL_PERIOD)
COLUMNS = 5


class Film:
    """Keeps what the pictures of a task's first episode need, and makes them afterwards."""

    def __init__(self, task: Tabletop) -> None:
        self._task = task
        self._painter = Painter(task)
        self._states: list[np.ndarray] = []
        self._moments: list[Moment] = []
        self._ticks = 0
        task.sim.record = self._record

    def add_phase(self, phase: Phase) -> None:
        """A panel: the scene at the start of a phase, targets and proposals drawn in."""
        moment = self._painter.moment(phase, 0)
        if (draw := phase.action.decision.draw) is not None:
            nodes = self._painter.proposed(phase, 0, draw)
            moment = moment._replace(proposals=self._painter.dots(nodes))
        self._moments.append(moment)

    def write(self, directory: Path) -> None:
        """Renders `phases.png` and `episode.mp4` into a directory."""
        panels = []
        for number, moment in enumerate(self._moments):
            panel = self._painter.picture(moment)
            ImageDraw.Draw(panel).text(
                (8, 8), f"{number + 1}", fill=(20, 20, 20), font_size=24
            )
            panels.append(np.asarray(panel))
        panels.append(self._frame(self._states[-1]))
        _strip(panels).save(directory / "phases.png")
        frames = (self._frame(qpos) for qpos in self._states)
        write_video(directory / "episode.mp4", frames, round(VIDEO_FPS))

    def _frame(self, qpos: np.ndarray) -> np.ndarray:
        model = self._task.sim.data[0].model
        return np.asarray(self._painter.picture(Moment(model, qpos)))

    def _record(self, episode: int, data: mujoco.MjData) -> None:
        self._ticks += 1
        if self._ticks % VIDEO_EVERY == 0:
            self._states.append(data.qpos.copy())


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

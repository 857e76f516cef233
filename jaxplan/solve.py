"""One episode for people: a line per phase, `episode.json`, a video and a film strip."""

import json
import os
import time
from pathlib import Path

import imageio.v3 as iio
import mujoco
import numpy as np
from PIL import Image, ImageDraw

from jaxplan.agent import Agent
from jaxplan.evaluation import Success, versions
from jaxplan.evaluation.success import episode_json
from jaxplan.learning import Weights
from jaxplan.motion import MotionPlanner
from jaxplan.rollout import EpisodeRecord, Phase, rollout
from jaxplan.scene.panda import PANDA_LIMITS
from jaxplan.simulation.camera import Camera, Mark
from jaxplan.tasks.mug import scene
from jaxplan.tasks.mug.kinematics import InverseKinematics
from jaxplan.tasks.mug.task import MugTask

VIDEO_EVERY = 6
"""Control periods between video frames."""
VIDEO_FPS = 1 / (VIDEO_EVERY * 0.01)
SIZE = (480, 640)
BLUE, GREEN, MAGENTA, ORANGE = (
    (0.15, 0.4, 1.0, 0.45),
    (0.1, 0.8, 0.2, 1.0),
    (0.9, 0.1, 0.8, 1.0),
    (1.0, 0.55, 0.0, 1.0),
)


def solve(
    seed: int,
    weights: tuple[Weights, Weights],
    out: str | os.PathLike | None = None,
    config: Success = Success(),
) -> EpisodeRecord:
    """Plans and executes one mug episode with learned weights.

    Args:
        seed: Of the mug's pose.
        weights: Predictor and sampler.
        out: Directory for `episode.json`, `episode.mp4` and `phases.png`; None writes nothing.
        config: Settings, as of the success study.
    """
    task = MugTask(1, config.camera, config.friction)
    planner = MotionPlanner(
        task.planning_scene, PANDA_LIMITS, config.planner, config.trajectory
    )
    agent = Agent(*weights, 1, config.inference_steps)
    film = None if out is None else Film(task)
    clock = time.perf_counter()

    def listen(phase: Phase) -> None:
        nonlocal clock
        _print_phase(phase, task, time.perf_counter() - clock)
        if film is not None:
            film.add_phase(phase)
        clock = time.perf_counter()

    record = rollout(
        task, [seed], agent.predict, planner, agent.propose, config.rollout, listen
    )[0]
    print(f"seed {seed}: {'success' if record.success else 'failed: ' + str(record.failure)}, "
          f"{len(record.phases)} phases, {record.expansions} expansions, {record.planning_seconds:.2f} s of search")  # fmt: skip
    if film is not None and out is not None:
        directory = Path(out)
        directory.mkdir(parents=True, exist_ok=True)
        episode = {**episode_json(record), "versions": versions()}
        (directory / "episode.json").write_text(json.dumps(episode, indent=1) + "\n")
        film.write(directory)
        print(f"written: {directory / 'episode.json'}, episode.mp4, phases.png")
    return record


def _print_phase(phase: Phase, task: MugTask, seconds: float) -> None:
    result, targets = phase.motion.result, phase.targets
    last = (
        bool(np.all(targets.q_goal[0] == targets.q_toggle[0]))
        and targets.gripper_toggle[0] != task.closed[0]
    )
    act = ("close" if targets.gripper_toggle[0] else "open") if last else "-"
    distance = float(np.linalg.norm(targets.q_goal[0] - phase.observation.q[0]))
    from jaxplan.planning import Status

    print(f"phase {phase.number + 1:2d}: {distance:4.2f} rad to the subgoal, {Status(result.status[0]).name.lower()} after "
          f"{int(result.expansions[0])} expansions in {phase.motion.seconds:.2f} s, motion of {len(phase.motion.q[0]) * 0.01:.1f} s, "
          f"gripper {act} ({seconds:.1f} s in all)")  # fmt: skip


class Film:
    """Keeps what an episode's pictures need, and makes them afterwards."""

    def __init__(self, task: MugTask) -> None:
        self._task = task
        self._states: list[np.ndarray] = []
        self._panels: list[tuple[np.ndarray, list[Mark], np.ndarray, str]] = []
        self._ticks = 0
        self._kinematics = InverseKinematics(task.model)
        task.sim.record = self._record

    def _record(self, episode: int, data: mujoco.MjData) -> None:
        self._ticks += 1
        if self._ticks % VIDEO_EVERY == 0:
            self._states.append(data.qpos.copy())

    def add_phase(self, phase: Phase) -> None:
        """A panel: the scene at the phase's start, targets and learned proposals drawn in."""
        marks = []
        if phase.segments is not None:
            # Where learned segments end when applied along the way, as the tree will apply them.
            nodes = phase.motion.result.path[
                0, : max(1, int(phase.motion.result.path_length[0]))
            ]
            direction, length = (
                np.asarray(phase.segments.direction[0]),
                np.asarray(phase.segments.length[0]),
            )
            ends = (
                nodes[:: max(1, len(nodes) // 4), None]
                + direction[:12] * length[:12, None]
            )
            marks += [
                Mark(self._kinematics.pose(q)[0], 0.004, BLUE)
                for q in ends.reshape(-1, 7)
            ]
        toggle = MAGENTA if phase.targets.gripper_toggle[0] == 0 else GREEN
        marks.append(
            Mark(self._kinematics.pose(phase.targets.q_toggle[0])[0], 0.012, toggle)
        )
        marks.append(
            Mark(self._kinematics.pose(phase.targets.q_goal[0])[0], 0.009, ORANGE)
        )
        self._panels.append(
            (
                self._task.sim.data[0].qpos.copy(),
                marks,
                phase.observation.image[0],
                f"{phase.number + 1}",
            )
        )

    def write(self, directory: Path) -> None:
        """Renders the video and the film strip."""
        model = scene.build("physics", self._task.shape)
        model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
        camera = Camera(model, *SIZE)
        data = mujoco.MjData(model)

        def picture(qpos: np.ndarray, marks: list[Mark]) -> np.ndarray:
            data.qpos[:] = qpos
            mujoco.mj_forward(model, data)
            return camera.render(data, "static", marks)

        panels = []
        for qpos, marks, seen, title in self._panels:
            panel = Image.fromarray(picture(qpos, marks))
            panel.paste(Image.fromarray(seen).resize((204, 132)), (SIZE[1] - 204, 0))
            ImageDraw.Draw(panel).text((8, 8), title, fill=(20, 20, 20), font_size=24)
            panels.append(np.asarray(panel))
        panels.append(picture(self._states[-1], []))
        columns = 5
        panels += [np.full_like(panels[0], 255)] * (-len(panels) % columns)
        rows = [
            np.concatenate(panels[k : k + columns], 1)
            for k in range(0, len(panels), columns)
        ]
        strip = Image.fromarray(np.concatenate(rows))
        strip.resize(
            (strip.width // 2, strip.height // 2), Image.Resampling.LANCZOS
        ).save(directory / "phases.png")
        frames = np.stack([picture(qpos, []) for qpos in self._states])
        iio.imwrite(
            directory / "episode.mp4", frames, fps=round(VIDEO_FPS), macro_block_size=1
        )

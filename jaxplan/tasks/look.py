"""Perturbed pictures of a task, of a model that looks different each time."""

import copy

import mujoco
import numpy as np

from jaxplan.simulation.camera import Camera
from jaxplan.tasks.perturbation import HUE, LIGHT_TURN, Drawn, turned, with_noise

DISTRACTOR, TEXTURED = "distractor", "textured"
"""What a model may have for pictures only: a mocap body, out of sight unless it is wanted; and a
material that takes the place of the table's."""
AWAY = (0.0, 0.0, -5.0)
DIM = 0.02
"""The least a colour's channel becomes."""


class Look:
    """What a camera takes pictures of.

    Args:
        model: How the task looks.
        camera: By name.
        reach: `[2, 2]` least and greatest x and y of where a distractor may lie [m].
    """

    def __init__(self, model: mujoco.MjModel, camera: str, reach: np.ndarray) -> None:
        self.given, self._model = model, copy.copy(model)
        self._data = mujoco.MjData(self._model)
        self._eye = model.camera(camera).id
        self._reach = reach
        names = [model.mat(i).name for i in range(model.nmat)]
        tables = model.geom_matid == names.index("table") if "table" in names else []
        self._tables = np.flatnonzero(tables)
        self._textured = names.index(TEXTURED) if TEXTURED in names else -1
        sky = np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
        self._sky = int(sky[0]) if len(sky) else -1
        bodies = [model.body(i).name for i in range(model.nbody)]
        self._distractor = -1
        if DISTRACTOR in bodies:
            self._distractor = int(model.body(DISTRACTOR).mocapid[0])

    @property
    def materials(self) -> int:
        """How many there are."""
        return self._model.nmat

    def picture(self, camera: Camera, qpos: np.ndarray, drawn: Drawn) -> np.ndarray:
        """`[H, W, 3]` uint8 of a state of the task's model."""
        self._dress(drawn)
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        return with_noise(camera.render(self._data, self._eye), drawn)

    def _dress(self, drawn: Drawn) -> None:
        """Changes how the copy looks."""
        given, model, eye = self.given, self._model, self._eye
        pose = turned(given.cam_quat[eye], given.cam_pos[eye], drawn)
        model.cam_quat[eye], model.cam_pos[eye] = pose
        self._light(drawn.light)
        shades = given.mat_rgba[:, :3] + HUE * drawn.colours[:-1]
        model.mat_rgba[:, :3] = np.clip(shades, DIM, 1.0)
        if self._textured >= 0:  # half of the time
            model.geom_matid[:] = given.geom_matid
            if drawn.colours[self._textured, 0] > 0:
                model.geom_matid[self._tables] = self._textured
        if self._sky >= 0:
            self._paint_sky(drawn.colours[-1])
        if self._distractor >= 0:
            self._place(drawn.distractor)

    def _light(self, light: np.ndarray) -> None:
        given, model = self.given, self._model
        turn, axis = np.zeros(4), np.array([light[0], light[1], 0.0])
        length = float(np.linalg.norm(axis))
        mujoco.mju_axisAngle2Quat(turn, axis / max(length, 1e-9), LIGHT_TURN * length)
        tint = (1 + 0.6 * light[2]) * (1 + 0.25 * light[4:])
        for i in range(model.nlight):
            mujoco.mju_rotVecQuat(model.light_dir[i], given.light_dir[i], turn)
            model.light_diffuse[i] = np.clip(given.light_diffuse[i] * tint, DIM, 1.0)
        ambience = 1 + 0.6 * light[3]
        for name in ("ambient", "diffuse"):
            value = np.array(getattr(given.vis.headlight, name))
            getattr(model.vis.headlight, name)[:] = np.clip(value * ambience, DIM, 1.0)

    def _paint_sky(self, colour: np.ndarray) -> None:
        given, model, sky = self.given, self._model, self._sky
        first = given.tex_adr[sky]
        size = given.tex_height[sky] * given.tex_width[sky] * given.tex_nchannel[sky]
        texels = given.tex_data[first : first + size].reshape(-1, 3)
        shaded = np.clip(texels + 255 * HUE * colour, 0, 255)
        model.tex_data[first : first + size] = shaded.astype(np.uint8).ravel()

    def _place(self, place: np.ndarray) -> None:
        data = self._data
        if np.isnan(place).any():
            data.mocap_pos[self._distractor] = AWAY
            return
        low, high = self._reach
        x, y = low + (place[:2] + 1) / 2 * (high - low)
        half = np.pi * place[2] / 2
        data.mocap_pos[self._distractor] = x, y, 0.0
        data.mocap_quat[self._distractor] = np.cos(half), 0, 0, np.sin(half)

"""What varies in the pictures of an episode: the camera's pose, noise, light, colours, clutter.

Drawn from the episode's seed, once for all of its pictures or anew for each. Physics, labels,
planner and judge never see it: pictures are taken of a copy of the model.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import mujoco
import numpy as np

from jaxplan.ranges import Checked, Range

Angle = Annotated[float, Range("0 to 45", lambda x: 0 <= x <= 45)]
Shift = Annotated[float, Range("0 to 0.1", lambda x: 0 <= x <= 0.1)]
Part = Annotated[float, Range("0 to 1", lambda x: 0 <= x <= 1)]

STREAM = 3
"""Of random numbers, beside those that the episode itself takes from its seed."""
LIGHT_TURN = np.radians(50)
"""How far the light's direction goes at strength 1 [rad]."""
HUE = 0.35
"""How far each channel of a colour goes at strength 1."""


@dataclass(frozen=True)
class Perturbation(Checked):
    """Bounds of what is drawn; 0 is nothing."""

    yaw: Angle = 0.0
    """Of the camera about its own upright axis, to either side [deg]."""
    pitch: Angle = 0.0
    """Of the camera about its own sideways axis [deg]; it does not roll."""
    translation: Shift = 0.0
    """Of the camera along each of its own axes [m]."""
    noise: Part = 0.0
    """Standard deviation of a pixel's noise, on values in [0, 1], clamped."""
    light: Part = 0.0
    """Strength of change in the light's direction, colour and brightness."""
    colours: Part = 0.0
    """Strength of change in the colours of all materials, and of the backdrop's."""
    distractor: bool = False
    """Something else lies on the table."""
    each_query: bool = False
    """Anew for each picture, and not once for the episode."""

    @property
    def nothing(self) -> bool:
        """Whether pictures are as they are."""
        bounds = self.yaw, self.pitch, self.translation, self.noise
        return not any((*bounds, self.light, self.colours, self.distractor))


NOMINAL = Perturbation()


class Drawn(NamedTuple):
    """One draw; also what a network that calibrates itself should say."""

    turn: np.ndarray
    """`[2]` yaw and pitch of the camera [rad]."""
    shift: np.ndarray
    """`[3]` along its axes: right, up, back [m]."""
    noise: float
    light: np.ndarray
    """`[7]` in [-1, 1]: two turns, brightness, ambience, colour."""
    colours: np.ndarray
    """`[materials + 1, 3]` in [-1, 1]; the backdrop's last."""
    distractor: np.ndarray
    """`[3]` in [-1, 1]: where it lies, and how it is turned; NaN = it is not there."""
    seed: int
    """Of the noise."""


def draw(perturbation: Perturbation, seed: int, query: int, materials: int) -> Drawn:
    """What a seed's picture number `query` varies by."""
    key = [seed, STREAM, query] if perturbation.each_query else [seed, STREAM]
    rng = np.random.default_rng(key)
    # In this order whatever is switched on, so that settings share what they have in common.
    turn, shift, light = (rng.uniform(-1, 1, n) for n in (2, 3, 7))
    colours = rng.uniform(-1, 1, (materials + 1, 3))
    place = rng.uniform(-1, 1, 3)
    bounds = np.radians([perturbation.yaw, perturbation.pitch])
    return Drawn(
        turn=turn * bounds,
        shift=shift * perturbation.translation,
        noise=perturbation.noise,
        light=light * perturbation.light,
        colours=colours * perturbation.colours,
        distractor=place if perturbation.distractor else np.full(3, np.nan),
        seed=int(np.random.default_rng([seed, STREAM, query, 1]).integers(2**31)),
    )


def turned(
    quat: np.ndarray, position: np.ndarray, drawn: Drawn
) -> tuple[np.ndarray, np.ndarray]:
    """Where a camera is mounted, after a draw.

    Args:
        quat: `[4]` of the mount; a camera looks along -z, y is up.
        position: `[3]` [m].
        drawn: Of which `turn` and `shift` count.

    Returns:
        Quaternion and position.
    """
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, quat)
    yaw, pitch = drawn.turn
    about_y, about_x, both, new = (np.zeros(4) for _ in range(4))
    mujoco.mju_axisAngle2Quat(about_y, np.array([0.0, 1.0, 0.0]), yaw)
    mujoco.mju_axisAngle2Quat(about_x, np.array([1.0, 0.0, 0.0]), pitch)
    mujoco.mju_mulQuat(both, about_y, about_x)
    mujoco.mju_mulQuat(new, quat, both)
    return new, position + axes.reshape(3, 3) @ drawn.shift


def with_noise(image: np.ndarray, drawn: Drawn) -> np.ndarray:
    """The picture `[H, W, 3]` uint8 with noise on its pixels, clamped."""
    if drawn.noise == 0:
        return image
    noise = np.random.default_rng(drawn.seed).normal(0, 255 * drawn.noise, image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)

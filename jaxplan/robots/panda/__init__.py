"""The Franka Panda with its parallel gripper."""

from importlib import resources

import mujoco
import numpy as np

from jaxplan.robots.panda.limits import LIMITS
from jaxplan.robots.panda.mount import CHAIN, MOUNT
from jaxplan.robots.panda.visual import add_visuals
from jaxplan.robots.robot import Gripper, Robot


def spec() -> mujoco.MjSpec:
    """The arm alone, with its looks."""
    text = (resources.files(__name__) / "panda.xml").read_text()
    model = mujoco.MjSpec.from_string(text)
    add_visuals(model)
    return model


PANDA = Robot(
    name="panda",
    spec=spec,
    limits=LIMITS,
    gripper=Gripper(
        open=0.04, closed=-0.035, release=0.010, speed=0.05, settle=0.15, met=0.001
    ),
    q_home=np.array([0.0, -0.35, 0.0, -2.2, 0.0, 1.85, 0.785]),
    chain=CHAIN,
    mount=MOUNT,
)

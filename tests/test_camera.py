"""Offscreen pictures: where points are in them, and cameras beside one another."""

import subprocess
import sys

import mujoco
import numpy as np

from jaxplan.simulation.camera import Camera

BALLS = """
<mujoco>
  <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
  <worldbody>
    <camera name="oblique" pos="1 -0.8 0.9" xyaxes="0.6 0.8 0 -0.4 0.3 0.87" fovy="50"/>
    <geom type="sphere" size="0.02" pos="0.1 0.05 0.1" rgba="1 0 0 1"/>
    <geom type="sphere" size="0.02" pos="-0.2 0.3 0" rgba="0 1 0 1"/>
    <geom type="sphere" size="0.02" pos="0.3 -0.2 0.3" rgba="0 0 1 1"/>
  </worldbody>
</mujoco>
"""


def balls():
    model = mujoco.MjModel.from_xml_string(BALLS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def test_points_are_projected_to_where_they_are_seen():
    model, data = balls()
    camera = Camera(model, 240, 320)
    free = mujoco.MjvCamera()
    free.lookat[:], free.distance = (0.05, 0.05, 0.1), 1.2
    for view in ("oblique", free):
        image = camera.render(data, view).astype(int)
        places = camera.project(data.geom_xpos)
        for color, place in enumerate(places):
            bright = image[..., color] - np.delete(image, color, 2).max(2) > 60
            seen = np.argwhere(bright)[:, ::-1].mean(0) + 0.5
            np.testing.assert_allclose(place, seen, atol=1.0)


def test_a_camera_survives_the_end_of_another():
    model, data = balls()
    first = Camera(model, 96, 128)
    before = first.render(data, "oblique")
    second = Camera(model, 96, 128)
    del first
    np.testing.assert_array_equal(second.render(data, "oblique"), before)


LEAVES = """
import weakref
class Thing: pass
thing = Thing()
weakref.finalize(thing, int)  # some library had one before
import mujoco
from jaxplan.simulation.camera import Camera
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><camera name='c'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
cameras = [Camera(model, 8, 8) for _ in range(2)]
for camera in cameras:
    camera.render(data, "c")
"""


def test_a_program_with_a_camera_ends_in_silence():
    done = subprocess.run(
        [sys.executable, "-c", LEAVES], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")

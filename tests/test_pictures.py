"""Pictures for people show what is there."""

import copy

import mujoco
import numpy as np

from jaxplan.pictures.painter import HEIGHT, WIDTH, Painter
from jaxplan.simulation.camera import Camera
from jaxplan.tasks.mug.task import MugTask


def test_each_lane_is_drawn_with_the_object_that_it_has():
    task = MugTask(2, objects="train")
    task.reset([0, 1], [2001, 2002])
    paint, pictures = Painter(task), []
    for lane in (0, 1, 0):
        moment = paint.now(lane)
        pictures.append(np.asarray(paint.picture(moment)))
        model = copy.copy(task.sim.data[lane].model)
        model.vis.quality.shadowsize, model.vis.quality.offsamples = 2048, 2
        data = mujoco.MjData(model)
        data.qpos[:] = moment.qpos
        mujoco.mj_forward(model, data)
        alone = Camera(model, HEIGHT, WIDTH).render(data, "static")
        np.testing.assert_array_equal(pictures[-1], alone)
    np.testing.assert_array_equal(pictures[0], pictures[2])
    assert (pictures[0] != pictures[1]).any()

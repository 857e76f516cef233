"""Compiled programs live as long as what they are of."""

import gc
import weakref

import numpy as np
import pytest

from jaxplan import Planner, Pose, Scene
from jaxplan.collision import certify, closest_pair, make_world, pair_motion_bounds

ARM = """<mujoco><worldbody><geom name="wall" type="box" size=".1 .1 1" pos="1 0 0"/>
  <body><joint type="hinge" axis="0 0 1" range="-150 150"/><geom type="capsule" size=".05 .2"/>
    <body name="hand" pos="0 0 .3"><joint type="hinge" axis="0 1 0" range="-90 90"/>
      <geom type="box" size=".05 .05 .05" pos=".1 0 0"/></body></body>
</worldbody></mujoco>"""
PATH = np.array([[0.0, 0.0], [1.0, 0.5]])


def plan_and_time(scene):
    planner = Planner(scene)
    plan = planner.plan(*PATH)
    planner.time(plan)
    planner.plan_batch(PATH[:1], PATH[1:])
    planner.ik(Pose("hand", [0.0, 0.0, 0.3]))


QUESTIONS = {
    "certify": lambda scene: certify(scene, make_world(scene), PATH),
    "prove": lambda scene: certify(scene, make_world(scene), PATH, continuous=True),
    "closest pair": lambda scene: closest_pair(scene, make_world(scene), PATH[0], 2.0),
    "bounds": lambda scene: pair_motion_bounds(scene, make_world(scene), PATH[1]),
    "plan": plan_and_time,
}


@pytest.mark.parametrize("ask", QUESTIONS.values(), ids=QUESTIONS)
def test_what_was_compiled_for_a_scene_goes_with_it(ask):
    scene = Scene.from_mjcf(ARM)
    ask(scene)
    alive = weakref.ref(scene.structure)
    del scene
    gc.collect()
    assert alive() is None

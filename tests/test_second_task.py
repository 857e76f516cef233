"""A second task: a cube to be picked up. One class, and a line in the registry."""

import mujoco
import numpy as np

from jaxplan import tasks
from jaxplan.base import Keyframes
from jaxplan.demonstrations import ExpertAgent
from jaxplan.demonstrations.expert import CLEAN
from jaxplan.episodes import run_episodes
from jaxplan.robots import PANDA
from jaxplan.robots.kinematics import InverseKinematics

HALF, PLACE = 0.02, np.array([0.5, 0.0, 0.02])
PHYSICS, PLANNING = (3, 1, 3), (4, 16, 4)
ALLOWED = ["left_finger|cube", "right_finger|cube", "cube|world"]


def build(ours, other):
    spec, box = PANDA.spec(), {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [HALF] * 3}
    group, contype, conaffinity = ours
    how = {"group": group, "contype": contype, "conaffinity": conaffinity}
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], **how)
    spec.worldbody.add_camera(name="static", pos=[1.5, 0, 0.8])
    cube = spec.worldbody.add_body(name="cube", pos=PLACE)
    cube.add_freejoint()
    cube.add_geom(**box, **how, mass=0.1)
    home = [*PANDA.q_home, 0.04, 0.04]
    spec.add_key(name="home", qpos=[*home, *PLACE, 1, 0, 0, 0], ctrl=home)
    for geom in [geom for geom in spec.geoms if geom.group == other[0]]:
        spec.delete(geom)
    return spec.compile()


class Pick(tasks.Tabletop):
    def __init__(self, batch, variant, camera, friction, perturbation, objects):
        models = build(PHYSICS, PLANNING), build(PLANNING, PHYSICS)
        allowed = {
            (how, at): ALLOWED for how in ("free", "held") for at in (False, True)
        }
        image = 24, 32
        super().__init__("pick", PANDA, *models, allowed, "cube", batch, camera, image)
        self.ik = InverseKinematics(PANDA, self.model)

    def reset(self, lanes, seeds):
        for lane, seed in zip(lanes, seeds, strict=True):
            pose = np.eye(4)
            pose[:3, 3] = PLACE
            pose[1, 3] += np.random.default_rng(seed).uniform(-0.1, 0.1)
            self.begin(lane, seed, pose)

    def keyframes(self, lane, q):
        place, (_, down) = self.object_pose(lane)[:3, 3], self.ik.pose(PANDA.q_home)
        above = np.array([0, 0, 0.1])
        ways = [self.ik.solve(p, down, PANDA.q_home) for p in (place + above, place)]
        return Keyframes(0, 1, np.stack([q for q, _ in ways]), max(e for _, e in ways))

    def unfit(self, lane):
        return None

    def in_terminal_region(self, lane):
        return bool(self.closed[lane])

    def failure(self, lane):
        return None if self.object_pose(lane)[2, 3] > 0.05 else "not lifted"


def test_the_expert_picks_up_cubes(monkeypatch):
    entry = tasks.TaskEntry(Pick, ("plain",), "panda")
    monkeypatch.setitem(tasks.TASKS, "pick", entry)
    task = tasks.load("pick", batch=2, camera="static")
    records = run_episodes(task, ExpertAgent(task, CLEAN), range(3))
    assert [record.failure for record in records] == [None] * 3

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
from jaxplan.tasks import Tabletop, TaskEntry
from jaxplan.tasks.mug.scene import PHYSICS, PLANNING, VISUAL

SIDE = 0.02


def build(ours: dict, other: dict) -> mujoco.MjModel:
    spec = PANDA.spec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 1], **ours)
    spec.worldbody.add_camera(name="static", pos=[1.5, 0, 0.8])
    cube = spec.worldbody.add_body(name="cube", pos=[0.5, 0, SIDE])
    cube.add_freejoint()
    size = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": 3 * [SIDE]}
    cube.add_geom(
        **size, mass=0.1, **ours | ({"contype": 16} if ours is PLANNING else {})
    )
    cube.add_geom(**size, mass=0, **VISUAL)
    home = [*PANDA.q_home, 0.04, 0.04]
    spec.add_key(name="home", qpos=[*home, 0.5, 0, SIDE, 1, 0, 0, 0], ctrl=home)
    for geom in [geom for geom in spec.geoms if geom.group == other["group"]]:
        spec.delete(geom)
    return spec.compile()


class Pick(Tabletop):
    def __init__(self, batch, variant, camera, friction):
        model, planning = build(PHYSICS, PLANNING), build(PLANNING, PHYSICS)
        pads = ["left_finger|cube", "right_finger|cube", "cube|world"]
        allowed = {
            (how, near): pads for how in ("free", "held") for near in (False, True)
        }
        super().__init__(
            "pick", PANDA, model, planning, allowed, "cube", batch, "static", (24, 32)
        )
        self.ik = InverseKinematics(PANDA, model)

    def reset(self, lanes, seeds):
        for lane, seed in zip(lanes, seeds, strict=True):
            pose = np.eye(4)
            pose[:3, 3] = 0.5, np.random.default_rng(seed).uniform(-0.1, 0.1), SIDE
            self.begin(lane, pose)

    def keyframes(self, lane, q):
        place, (_, down) = self.object_pose(lane)[:3, 3], self.ik.pose(PANDA.q_home)
        ways = [self.ik.solve(place + [0, 0, z], down, PANDA.q_home) for z in (0.1, 0)]
        return Keyframes(0, 1, np.stack([q for q, _ in ways]), max(e for _, e in ways))

    def unfit(self, lane):
        return None

    def in_terminal_region(self, lane):
        return bool(self.closed[lane])

    def failure(self, lane):
        return (
            None if self.object_pose(lane)[2, 3] > 0.05 else "the cube was not lifted"
        )


def test_the_expert_picks_up_cubes(monkeypatch):
    monkeypatch.setitem(tasks.TASKS, "pick", TaskEntry(Pick, ("plain",), "panda"))
    task = tasks.load("pick", batch=2, camera="static")
    records = run_episodes(task, ExpertAgent(task, CLEAN), range(3))
    assert [record.failure for record in records] == [None] * 3

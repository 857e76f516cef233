"""PyBullet's collision checker on the same spheres, obstacles and pairs.

Needs the package `pybullet`; `peers.absent("pybullet")` says whether it is here.
"""

import tempfile
from collections.abc import Iterable

import numpy as np
import pybullet  # pyright: ignore[reportMissingImports]

from jaxplan.collision import Obstacle


class PybulletChecker:
    """One scene in a simulation of its own, without a window.

    This is the fastest way through PyBullet's interface that we found: all joints set in
    one call, then one collision pass, 2 to 3 times faster than joint by joint. Queries of
    `getClosestPoints` are slower still and disregard which pairs are filtered.
    """

    def __init__(self, robot: dict, obstacles: Iterable[Obstacle]) -> None:
        self._client = client = pybullet.connect(pybullet.DIRECT)
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(panda_urdf(robot))
            file.flush()
            self._arm = arm = pybullet.loadURDF(
                file.name,
                useFixedBase=True,
                flags=pybullet.URDF_USE_SELF_COLLISION,
                physicsClientId=client,
            )
        # PyBullet numbers the links as it meets them, from -1 for the base.
        infos = [
            pybullet.getJointInfo(arm, joint, physicsClientId=client)
            for joint in range(pybullet.getNumJoints(arm, physicsClientId=client))
        ]
        ids = {info[12].decode(): info[0] for info in infos} | {"panda_link0": -1}
        self._joints = [i[0] for i in infos if i[2] == pybullet.JOINT_REVOLUTE]
        for a, b in robot["disable_collisions"]:
            pybullet.setCollisionFilterPair(
                arm, arm, ids[a], ids[b], 0, physicsClientId=client
            )
        for obstacle in obstacles:
            body = self._add(obstacle)
            # The base does not move, so it is not asked about, as with MuJoCo.
            pybullet.setCollisionFilterPair(
                arm, body, -1, -1, 0, physicsClientId=client
            )

    def config_free(self, q: np.ndarray) -> np.ndarray:
        """`[n]` whether no pair touches in each configuration `[n, 7]` [rad]."""
        return np.array([self._free(row) for row in q[..., None].tolist()])

    def close(self) -> None:
        """Ends the simulation."""
        pybullet.disconnect(self._client)

    def _free(self, row: list[list[float]]) -> bool:
        client = self._client
        pybullet.resetJointStatesMultiDof(
            self._arm, self._joints, row, physicsClientId=client
        )
        pybullet.performCollisionDetection(physicsClientId=client)
        contacts = pybullet.getContactPoints(physicsClientId=client)
        # Bullet also lists what is near; field 8 is the distance.
        return all(contact[8] > 0 for contact in contacts)

    def _add(self, obstacle: Obstacle) -> int:
        kind, client = obstacle.kind, self._client
        x, y, z = [*obstacle.size, 0, 0][:3]
        round_size = {"radius": x, "height": 2 * y}  # a sphere's height is not read
        size = {"halfExtents": [x, y, z]} if kind == "box" else round_size
        shape = pybullet.createCollisionShape(
            getattr(pybullet, f"GEOM_{kind.upper()}"), **size, physicsClientId=client
        )
        position, (w, *axis) = obstacle.pose[:3], obstacle.pose[3:]
        return pybullet.createMultiBody(
            0, shape, -1, position, [*axis, w], physicsClientId=client
        )


def panda_urdf(robot: dict) -> str:
    """The Panda as URDF: what `robot_mjcf` is as MJCF.

    Args:
        robot: What `motion_bench.read_robot` gives.
    """
    links = "".join(
        f'<link name="{link}">\n{_INERTIAL}{"".join(map(_sphere, spheres))}</link>\n'
        for link, spheres in robot["links"].items()
    )
    joints = "".join(map(_joint, robot["joints"]))
    return f'<robot name="panda">\n{links}{joints}</robot>\n'


# Nothing moves by itself here; PyBullet warns of links without a mass.
_INERTIAL = """<inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
"""


def _sphere(sphere: dict) -> str:
    return f"""<collision><origin xyz="{_row(sphere["position"])}"/>
<geometry><sphere radius="{sphere["radius"]}"/></geometry></collision>
"""


def _joint(joint: dict) -> str:
    moving = ""
    if joint["type"] == "revolute":
        low, high = joint["limit"]
        moving = f"""<axis xyz="{_row(joint["axis"])}"/>
<limit lower="{low}" upper="{high}" effort="1" velocity="1"/>
"""
    return f"""<joint name="{joint["name"]}" type="{joint["type"]}">
<parent link="{joint["parent"]}"/><child link="{joint["child"]}"/>
<origin xyz="{_row(joint["xyz"])}" rpy="{_row(joint["rpy"])}"/>
{moving}</joint>
"""


def _row(numbers: Iterable[float]) -> str:
    return " ".join(map(str, numbers))

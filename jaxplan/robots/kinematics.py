"""Inverse kinematics that never jumps: continued from a reference, with one null-space rule."""

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from jaxplan.robots.robot import Robot

DAMPING = 1e-5 * np.eye(6)
"""Of the least squares, for poses near a singularity."""


class InverseKinematics:
    """Joint angles that bring the tool centre point to a pose.

    The answer is a continuous function of the pose: each solve starts at the same reference
    configuration, walks the straight line (and the geodesic turn) from the reference's pose to
    the target in small steps, and settles in the null space nearest to the reference.
    """

    def __init__(self, robot: Robot, model: mujoco.MjModel) -> None:
        self._model, self._arm = model, robot.arm
        self._data = mujoco.MjData(model)
        self._site = model.site(robot.tcp).id
        self._jacobian = np.zeros((6, model.nv))
        limits = model.jnt_range[robot.arm].T
        self._lower, self._upper = limits + np.array([[0.02], [-0.02]])

    def pose(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Position [m] and rotation matrix of the tool centre point."""
        self._data.qpos[self._arm] = q
        mujoco.mj_kinematics(self._model, self._data)
        position = self._data.site_xpos[self._site]
        rotation = self._data.site_xmat[self._site].reshape(3, 3)
        return position.copy(), rotation.copy()

    def solve(
        self,
        position: np.ndarray,
        rotation: np.ndarray,
        q_reference: np.ndarray,
        step: float = 0.1,
        settle: int = 25,
    ) -> tuple[np.ndarray, float]:
        """Solves for a pose of the tool centre point.

        Args:
            position: Target [m], shape `[3]`.
            rotation: Target axes as columns, shape `[3, 3]`.
            q_reference: Where the continuation starts and what the null space prefers [rad].
            step: Longest stride of the continuation [0.4 m or rad].
            settle: Iterations at the target.

        Returns:
            `q` inside the joint limits, and the error that is left [m + rad].
        """
        p_0, r_0 = self.pose(q_reference)
        turn = Rotation.from_matrix(rotation @ r_0.T).as_rotvec()
        length = max(np.linalg.norm(position - p_0) / 0.4, np.linalg.norm(turn))
        strides = int(np.ceil(length / step)) + 1
        q, error = q_reference.copy(), np.ones(6)
        for s in np.append(np.linspace(0, 1, strides + 1)[1:], np.ones(settle)):
            target = Rotation.from_rotvec(s * turn).as_matrix() @ r_0
            q, error = self._newton(q, p_0 + s * (position - p_0), target, q_reference)
        for _ in range(100):
            if np.linalg.norm(error) < 1e-5:
                break
            q, error = self._newton(q, position, rotation, q_reference)
        p, r = self.pose(q)
        angle = np.linalg.norm(Rotation.from_matrix(rotation @ r.T).as_rotvec())
        return q, float(np.linalg.norm(position - p) + angle)

    def retreat(self, q: np.ndarray, distance: float) -> np.ndarray:
        """Joints [rad] of a hand that has backed off by `distance` [m] along its own axis."""
        position, rotation = self.pose(q)
        return self.solve(position - distance * rotation[:, 2], rotation, q)[0]

    def _newton(
        self,
        q: np.ndarray,
        position: np.ndarray,
        rotation: np.ndarray,
        q_reference: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """One damped step toward a pose; also the error `[6]` before it [m, rad]."""
        p, r = self.pose(q)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_jacSite(
            self._model, self._data, self._jacobian[:3], self._jacobian[3:], self._site
        )
        jacobian = self._jacobian[:, self._arm]
        turn = rotation @ r.T
        w = 0.5 * np.array(
            [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
        )
        error = np.concatenate([position - p, w])
        posture = 0.3 * (q_reference - q)
        damped = jacobian @ jacobian.T + DAMPING
        dq = posture + jacobian.T @ np.linalg.solve(damped, error - jacobian @ posture)
        dq *= min(1.0, 0.3 / (np.abs(dq).max() + 1e-9))
        return np.minimum(np.maximum(q + dq, self._lower), self._upper), error

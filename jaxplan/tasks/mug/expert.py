"""The scripted expert: where the gripper toggles next, and the keyframes on the way there.

Its answers are a function of the mug's pose, the joints and the gripper alone. One rim side, one
finger flip and one pitch serve the whole range of mugs, and inverse kinematics is continued from
one reference, so that labels never jump (methods: labels must be single-valued).
"""

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from jaxplan.base import Keyframes
from jaxplan.robots import PANDA
from jaxplan.robots.kinematics import InverseKinematics
from jaxplan.tasks.mug.mug import MugShape
from jaxplan.tasks.mug.scene import BOX_FLOOR
from jaxplan.tasks.mug.variant import BOX
from jaxplan.tasks.tabletop import RETREAT

UP = np.array([0.0, 0.0, 1.0])
PITCH = np.radians(45)
INSERTION = 0.004
"""Depth of the pads' centres below the rim [m]; the pads' corners reach 12 mm."""
STAGING = np.array([0.48, 0.0])
"""Where the mug is put upright [m]."""
STAGING_YAWS = np.radians([-150, 100])
"""Direction of the handle when put upright [rad]: of a mug that lay on its left or right side, so
that neither asks for a large turn of the wrist."""
BOX_YAWS = np.radians([-120, 90])
"""Direction of the handle in the box [rad], likewise."""
REACH = 0.076
"""Of a handle that has its place in the box when the mug stands in the middle [m]."""
DROP = 0.0015
"""Gap below the mug when it is let go [m]."""
Q_RIM = np.array([0.1367, 0.4522, 0.1779, -2.3652, -1.1305, 2.1755, 0.4094])
"""Reference of the rim grasp, in the middle of the range [rad]."""


class Toggle(IntEnum):
    """The four contact events, in order."""

    GRASP1 = 0
    RELEASE1 = 1
    GRASP2 = 2
    RELEASE2 = 3


Approach = tuple[list[np.ndarray], np.ndarray]
"""Poses `[4, 4]` of the tool centre point, the toggle's last, and their IK's reference [rad]."""


class Expert:
    """Answers what the predictor learns to answer, from the state that the predictor never sees.

    Args:
        kinematics: Of the arm.
        shape: Of the mug.
        box: Where the box stands [m].
    """

    def __init__(
        self,
        kinematics: InverseKinematics,
        shape: MugShape = MugShape(),
        box: ArrayLike = BOX,
    ) -> None:
        self._ik, self._shape, self._box = kinematics, shape, box

    def next_toggle(self, mug: np.ndarray, q: np.ndarray, closed: bool) -> Toggle:
        """Which event comes next, for a mug pose `[4, 4]`, joints [rad] and gripper."""
        if not closed:
            return Toggle.GRASP2 if mug[2, 2] > 0.9 else Toggle.GRASP1
        position, _ = self._ik.pose(q)
        inside = mug[:3, :3].T @ (position - mug[:3, 3])
        between = (self._shape.radius + self._shape.bar_radius) / 2
        by_handle = np.hypot(inside[0], inside[1]) > between
        return Toggle.RELEASE2 if by_handle else Toggle.RELEASE1

    def keyframes(self, mug: np.ndarray, q: np.ndarray, closed: bool) -> Keyframes:
        """Keyframes of the next toggle.

        They are: retreat (where a hand must leave the mug first), transit (looks again),
        pre-contact, toggle.

        Args:
            mug: Pose of the mug in the world, `[4, 4]`.
            q: Joints at the start [rad]; with a closed gripper they tell how the mug is held.
            closed: Whether the gripper is closed.
        """
        toggle = self.next_toggle(mug, q, closed)
        targets, reference = {
            Toggle.GRASP1: self._grasp_rim,
            Toggle.RELEASE1: self._put_upright,
            Toggle.GRASP2: self._grasp_handle,
            Toggle.RELEASE2: self._put_in_box,
        }[toggle](mug, q)
        solved = [self._ik.solve(t[:3, 3], t[:3, :3], reference) for t in targets]
        if len(targets) == 4:
            # Backing off must not change the arm's posture: continued from where the hand is.
            solved[0] = self._ik.solve(targets[0][:3, 3], targets[0][:3, :3], q)
        return Keyframes(
            toggle,
            int(not closed),
            np.stack([q for q, _ in solved]),
            max(error for _, error in solved),
        )

    def _grasp_rim(self, mug: np.ndarray, q: np.ndarray) -> Approach:
        axis = mug[:3, 2] * [1, 1, 0]
        axis /= np.linalg.norm(axis)
        side = np.cross(UP, axis)
        shape = self._shape
        contact = (
            mug[:3, 3]
            + axis * (shape.height / 2 - INSERTION)
            + side * (shape.radius - shape.wall / 2)
        )
        contact[2] = shape.radius
        approach = -axis * np.cos(PITCH) - UP * np.sin(PITCH)
        axes = np.stack([np.cross(-side, approach), -side, approach], 1)
        grasp = _pose(contact, axes)
        transit = _moved(grasp, -0.11 * approach + [0, 0, 0.05])
        return [transit, _moved(grasp, -0.06 * approach), grasp], Q_RIM

    def _put_upright(self, mug: np.ndarray, q: np.ndarray) -> Approach:
        turned = self._handle_is_right(mug, q)
        place = [*STAGING, self._shape.height / 2 + DROP]
        target = _pose(place, _yaw(STAGING_YAWS[turned]))
        release = self._hand_for(mug, q, target)
        lift = _moved(_pose(*self._ik.pose(q)), [0, 0, 0.18])
        return [lift, _moved(release, [0, 0, 0.05]), release], Q_RIM

    def _grasp_handle(self, mug: np.ndarray, q: np.ndarray) -> Approach:
        out = mug[:3, 0] * [1, 1, 0]
        out /= np.linalg.norm(out)
        across = np.cross(out, UP) * (1 if out[1] > 0 else -1)
        contact = mug[:3, 3] + out * self._shape.bar_radius
        contact[2] = mug[2, 3] - self._shape.height / 2 + self._shape.grip_height
        grasp = _pose(contact, np.stack([np.cross(across, -UP), across, -UP], 1))
        frames = [_moved(grasp, [0, 0, 0.16]), _moved(grasp, [0, 0, 0.06]), grasp]
        hand = _pose(*self._ik.pose(q))
        at_rim = hand[2, 2] > -0.9 and np.linalg.norm(hand[:3, 3] - mug[:3, 3]) < 0.10
        if at_rim:
            frames.insert(0, _moved(hand, -RETREAT * hand[:3, 2]))
        return frames, PANDA.q_home

    def _put_in_box(self, mug: np.ndarray, q: np.ndarray) -> Approach:
        place = _moved(
            _pose(self._box, _yaw(BOX_YAWS[int(mug[1, 0] > 0)])),
            [0, 0, BOX_FLOOR + self._shape.height / 2 + DROP],
        )
        # A handle that would lie on the box's wall: the mug stands beside the middle.
        place = _moved(
            place, -max(0.0, self._shape.handle_reach - REACH) * place[:3, 0]
        )
        release = self._hand_for(mug, q, place)
        lift = _moved(_pose(*self._ik.pose(q)), [0, 0, 0.12])
        return [lift, _moved(release, [0, 0, 0.09]), release], PANDA.q_home

    def _handle_is_right(self, mug: np.ndarray, q: np.ndarray) -> int:
        """Whether the handle lies on the other side of the axis than the rim that is held."""
        position, _ = self._ik.pose(q)
        return int(np.dot(mug[:3, 0], position - mug[:3, 3]) < 0)

    def _hand_for(
        self, mug: np.ndarray, q: np.ndarray, target: np.ndarray
    ) -> np.ndarray:
        """Where the tool centre point brings the mug that it holds to `target`."""
        hand = _pose(*self._ik.pose(q))
        return target @ np.linalg.inv(mug) @ hand


def _pose(position: ArrayLike, rotation: np.ndarray) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _moved(pose: np.ndarray, offset: ArrayLike) -> np.ndarray:
    moved = pose.copy()
    moved[:3, 3] += offset
    return moved


def _yaw(angle: float) -> np.ndarray:
    return Rotation.from_euler("z", angle).as_matrix()

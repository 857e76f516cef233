"""Actions as physics carries them out: motions, the gripper's toggles, and waiting for them."""

from collections.abc import Callable, Sequence

import numpy as np

from jaxplan.base import Action
from jaxplan.simulation.physics import Simulator

AWAY = 0.07
"""So far from where it released, a gripper opens all the way [m]."""


class Execution:
    """The arms of a batch of episodes.

    Args:
        sim: Their physics.
        tcp: A lane's tool centre point, `[3]` [m].
        batch: B, how many lanes there are.
    """

    def __init__(
        self, sim: Simulator, tcp: Callable[[int], np.ndarray], batch: int
    ) -> None:
        self._sim, self._tcp = sim, tcp
        self.closed = np.zeros(batch, bool)
        """`[B]` which grippers are closed, or were told to close."""
        self._released: list[np.ndarray | None] = [None] * batch
        """Where grippers have released that are not open all the way, `[3]` [m]."""

    def begin(self, lane: int) -> None:
        """A lane's gripper is open all the way."""
        self.closed[lane], self._released[lane] = False, None

    def execute(self, lanes: Sequence[int], action: Action) -> np.ndarray:
        """Moves and toggles; `[B]` bool, which toggled."""
        toggled = np.zeros(len(self.closed), bool)
        toggled[list(lanes)] = self._sim.map(lambda e: self._run(e, action), lanes)
        return toggled

    def _run(self, lane: int, action: Action) -> bool:
        """One lane's commands, to the next change of the gripper's mode and on from there."""
        q, modes = action.q[lane], action.gripper[lane]
        first, toggled = 0, False
        for at in range(len(q)):
            if bool(modes[at]) == self.closed[lane] or (
                at and modes[at] == modes[at - 1]
            ):
                continue
            self._follow(lane, q[first : at + 1], action.settle)
            first = at
            off = np.abs(self._sim.q(lane) - action.q_toggle[lane]).max()
            if off < action.tolerance:
                self._toggle(lane, bool(modes[at]))
                toggled = True
        self._follow(lane, q[first:], action.settle)
        return toggled

    def _follow(self, lane: int, q: np.ndarray, settle: float) -> None:
        """Executes commands `[T, d]`, if they are a motion.

        Fingers that have released then open wide, if the hand is away from there.
        """
        if len(q) < 2:
            return
        self._sim.follow(lane, q, settle)
        released = self._released[lane]
        if released is not None and np.linalg.norm(self._tcp(lane) - released) > AWAY:
            self._sim.open_wide(lane)
            self._released[lane] = None

    def _toggle(self, lane: int, close: bool) -> None:
        """Toggles a gripper, ramped."""
        (self._sim.close if close else self._sim.open)(lane)
        self.closed[lane] = close
        self._released[lane] = None if close else self._tcp(lane).copy()

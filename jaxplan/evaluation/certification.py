"""What `certify` says about planned paths and executed motions."""

from collections import Counter

import jax
import numpy as np

from jaxplan.base import Phase
from jaxplan.collision import certify
from jaxplan.motion import MotionPlanner
from jaxplan.planning import Status
from jaxplan.scene import Scene


class Certification:
    """Listens to Algorithm 1 and certifies every path, and every motion before it runs.

    Contacts deeper than 1 mm are refused.

    Args:
        planner: Whose paths are judged.
        scene: In which; by default the planner's own.
    """

    def __init__(self, planner: MotionPlanner, scene: Scene | None = None) -> None:
        self._scene = planner.scene if scene is None else scene
        self.statuses: Counter[str] = Counter()
        self.blocked = 0
        """Problems whose straight line from start to goal is refused."""
        self.refused: list[str] = []
        self.invalid: list[str] = []

    def __call__(self, phase: Phase) -> None:
        """Certifies a round."""
        decision = phase.action.decision
        result = decision.motion.result
        for e in phase.lanes:
            self.statuses[Status(result.status[e]).name] += 1
            world = jax.tree.map(lambda leaf, e=e: leaf[e], decision.worlds)
            line = phase.observation.q[e], decision.subgoal.q_goal[e]
            straight = certify(self._scene, world, np.array(line, float))
            self.blocked += not straight.valid
            path = result.path[e, : result.path_length[e]]
            for waypoints, said in (
                (path, self.refused),
                (decision.motion.q[e], self.invalid),
            ):
                if len(waypoints) < 2:
                    continue
                certificate = certify(self._scene, world, np.asarray(waypoints, float))
                if not certificate.valid:
                    said.append(f"phase {phase.number + 1}: {certificate.reason}")

    def summary(self) -> dict:
        """Counts, and what was refused."""
        problems = sum(self.statuses.values())
        return {
            "problems": problems,
            "solved": self.statuses[Status.SOLVED.name],
            "statuses": dict(self.statuses),
            "straight_lines_refused": self.blocked,
            "paths_refused": len(self.refused),
            "motions_invalid": len(self.invalid),
            "examples": (self.refused + self.invalid)[:20],
        }

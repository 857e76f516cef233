"""Why a question has no path, in a line."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.plan import Plan
from jaxplan.planning import Status
from jaxplan.scene import Scene

UNITS = {"hinge": "rad", "slide": "m"}
"""Of a joint's position, by its kind."""


class Asked(NamedTuple):
    """A question and its answer."""

    scene: Scene
    plan: Plan
    q_start: np.ndarray
    q_goal: np.ndarray
    limits: tuple[np.ndarray, np.ndarray]
    margin: float

    @property
    def ends(self) -> dict[str, np.ndarray]:
        """Start and goal, by name."""
        return {"start": self.q_start, "goal": self.q_goal}


def no_path(
    scene: Scene,
    plan: Plan,
    q_start: np.ndarray,
    q_goal: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
    margin: float,
) -> str:
    """Names what is in the way: joint, pair of geoms, or how far the search came.

    Args:
        scene: Of the question.
        plan: Its answer.
        q_start: `[d]` [rad or m].
        q_goal: `[d]` [rad or m].
        limits: `(q_min [d], q_max [d])` of the search [rad or m].
        margin: Clearance that counted as free [m].

    Returns:
        Empty if there is a path.
    """
    asked = Asked(scene, plan, q_start, q_goal, limits, margin)
    return REASONS[plan.status](asked) if plan.status in REASONS else ""


def with_unit(scene: Scene, joint: str, position: float) -> str:
    """A joint's position in words: "0.1000 m"."""
    return f"{position:.4f} {UNITS[scene.joint_kind(joint)]}"


def joint_distance(scene: Scene, distance: float) -> str:
    """A distance between configurations in words: hinges and slides have no unit together."""
    units = {UNITS[scene.joint_kind(joint)] for joint in scene.joints}
    unit = units.pop() if len(units) == 1 else "(rad and m)"
    return f"{distance:.3f} {unit}"


def _exhausted(asked: Asked) -> str:
    scene, plan = asked.scene, asked.plan
    gap = float(np.linalg.norm(plan.path[-1] - asked.q_goal))
    return (
        f"no path after {plan.expansions} expansions; "
        f"the nearest node is {joint_distance(scene, gap)} from the goal"
    )


def _in_collision(end: str) -> Callable[[Asked], str]:
    def reason(asked: Asked) -> str:
        q = asked.ends[end]
        contact = _contact(asked.scene, asked.plan.world, q, asked.margin)
        return f"{end} in collision: {contact}"

    return reason


def _out_of_limits(asked: Asked) -> str:
    q_min, q_max = asked.limits
    over = {n: np.maximum(q_min - q, q - q_max) for n, q in asked.ends.items()}
    end = max(over, key=lambda name: over[name].max())
    j = int(np.argmax(over[end]))
    joint, scene = asked.scene.joints[j], asked.scene
    at, low, high = (
        with_unit(scene, joint, q[j]) for q in (asked.ends[end], q_min, q_max)
    )
    return f"{end} out of limits: joint {joint!r} at {at}, limits {low} to {high}"


def _not_finite(asked: Asked) -> str:
    for end, q in asked.ends.items():
        for j in np.flatnonzero(~np.isfinite(q)).tolist():
            return f"{end} is not finite: joint {asked.scene.joints[j]!r} is {q[j]}"
    return ""


REASONS: dict[Status, Callable[[Asked], str]] = {
    Status.BUDGET_EXHAUSTED: _exhausted,
    Status.START_IN_COLLISION: _in_collision("start"),
    Status.GOAL_IN_COLLISION: _in_collision("goal"),
    Status.OUT_OF_LIMITS: _out_of_limits,
    Status.INVALID_INPUT: _not_finite,
}
"""Who finds the words for a status; the others have a path, or nobody asked."""


def _contact(scene: Scene, world: World, q: np.ndarray, margin: float) -> str:
    """The closest pair at q, by name, and how deep it is."""
    if not all(np.isfinite(np.asarray(leaf)).all() for leaf in world):
        return "the world has values that are not finite"
    poses = np.concatenate([world.object_pose, world.slot_pose])
    if not poses[:, 3:].any(-1).all():
        return "the world has a quaternion of zeros"
    pair, distance = collision.closest_pair(scene, world, q, 0.01)
    if pair is None:
        return "nothing within 10 mm by C MuJoCo"
    if distance >= 0:
        return (
            f"{pair[0]} and {pair[1]} are {1000 * distance:.2f} mm apart, "
            f"margin {1000 * margin:.2f} mm"
        )
    return f"{pair[0]} and {pair[1]}, {-1000 * distance:.2f} mm deep"

"""Why a question has no path, in a line."""

import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.plan import Plan
from jaxplan.planning import Status
from jaxplan.scene import Scene


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
        q_start: `[d]` [rad].
        q_goal: `[d]` [rad].
        limits: `(q_min [d], q_max [d])` of the search [rad].
        margin: Clearance that counted as free [m].

    Returns:
        Empty if there is a path.
    """
    q_min, q_max = limits
    if plan.status == Status.BUDGET_EXHAUSTED:
        gap = np.linalg.norm(plan.path[-1] - q_goal)
        return (
            f"no path after {plan.expansions} expansions; "
            f"the nearest node is {gap:.3f} rad from the goal"
        )
    ends = (("start", q_start), ("goal", q_goal))
    if plan.status in (Status.START_IN_COLLISION, Status.GOAL_IN_COLLISION):
        name, q = ends[plan.status == Status.GOAL_IN_COLLISION]
        return f"{name} in collision: {_contact(scene, plan.world, q, margin)}"
    if plan.status == Status.OUT_OF_LIMITS:
        over = [np.maximum(q_min - q, q - q_max) for _, q in ends]
        name, q = ends[int(over[1].max() > over[0].max())]
        j = int(np.argmax(np.maximum(*over)))
        return (
            f"{name} out of limits: joint {scene.joints[j]!r} at {q[j]:.4f}, "
            f"limits {q_min[j]:.4f} to {q_max[j]:.4f}"
        )
    if plan.status == Status.INVALID_INPUT:
        for name, q in ends:
            for j in np.flatnonzero(~np.isfinite(q)):
                return f"{name} is not finite: joint {scene.joints[j]!r} is {q[j]}"
    return ""


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

"""Why a problem has no path, in a line."""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxplan import collision
from jaxplan.collision import World
from jaxplan.collision.oracle import contacts_of, names_of
from jaxplan.ik import Limits
from jaxplan.motion.barriers import FEW, Free, barrier_between
from jaxplan.motion.goals import Goals
from jaxplan.motion.plan import Plan
from jaxplan.planning import Status
from jaxplan.planning.space import Space
from jaxplan.scene import Scene

UNITS = {"hinge": "rad", "slide": "m"}
"""Of a joint's position, by its kind."""
ENOUGH = 1000
"""Expansions after which something may be in the way for good."""


class Asked(NamedTuple):
    """A problem and its answer."""

    scene: Scene
    plan: Plan
    q_start: np.ndarray
    """`[d]` [rad or m]."""
    goals: Goals
    limits: Limits
    """Of the search."""
    margin: float
    """Clearance that counted as free [m]."""
    nodes: np.ndarray
    """`[2]` of the start's tree and of the goal's."""
    free: Free | None
    """Of its world; None where there is no time to look for what hinders."""

    @property
    def ends(self) -> dict[str, np.ndarray]:
        """Start and goal, by name."""
        return {"start": self.q_start, "goal": self.goals.q[0]}


def no_path(asked: Asked) -> str:
    """Names what is in the way: joint, pair of geoms, or how far the search came.

    Returns:
        Empty if there is a path.
    """
    status = asked.plan.status
    return REASONS[status](asked) if status in REASONS else ""


def with_unit(scene: Scene, joint: str, position: float) -> str:
    """A joint's position in words: "0.1000 m"."""
    return f"{position:.4f} {UNITS[scene.joint_kind(joint)]}"


def joint_distance(scene: Scene, distance: float) -> str:
    """A distance between configurations in words: hinges and slides have no unit together."""
    units = {UNITS[scene.joint_kind(joint)] for joint in scene.joints}
    unit = units.pop() if len(units) == 1 else "(rad and m)"
    return f"{distance:.3f} {unit}"


def _searched(asked: Asked) -> str:
    """Of a search that ended before it was there."""
    scene, plan = asked.scene, asked.plan
    space = Space.of(*asked.limits)
    gap = space.gap(jnp.asarray(plan.path[-1]), jnp.asarray(asked.goals.q))
    least = float(jnp.linalg.norm(gap, axis=1).min())
    spent = f"{plan.expansions} expansions"
    if plan.status == Status.TIME_OUT:
        spent = f"{plan.time:.3f} s and {spent}"
    near = f"the nearest node is {joint_distance(scene, least)} from the goal"
    hindered = ""
    if plan.expansions >= ENOUGH:
        hindered = _enclosed(asked) or _barred(asked, space)
    return f"no path after {spent}; {near}{hindered}"


def _enclosed(asked: Asked) -> str:
    """Says so where a tree could not grow."""
    grown = asked.nodes - (1, len(asked.goals.q))
    for end, nodes in zip(("start", "goal"), grown.tolist(), strict=True):
        if nodes <= 0:
            return (
                f"; the {end} seems enclosed: not one of the motions from it that were "
                "tried is free"
            )
    return ""


def _barred(asked: Asked, space: Space) -> str:
    """Names a joint that hinders every way, if there is one."""
    if asked.free is None:
        return ""
    found = barrier_between(asked.free, asked.q_start, asked.goals.q, space)
    if found is None:
        return ""
    scene, world = asked.scene, asked.plan.world
    joint = scene.joints[found.joint]
    at = " and ".join(with_unit(scene, joint, x) for x in found.positions)
    said = (
        f"; no path may exist: on every way from start to goal joint {joint!r} passes {at}, "
        f"where none of {len(found.q)} random configurations is free"
    )
    contacts = contacts_of(scene, world, found.q[:FEW], asked.margin)
    always = set.intersection(*({*map(tuple, geoms.tolist())} for _, geoms in contacts))
    pairs = [" and ".join(names_of(scene, pair) or ()) for pair in sorted(always)[:1]]
    return said + "".join(f": {pair} touch" for pair in pairs)


def _start_in_collision(asked: Asked) -> str:
    contact = _contact(asked.scene, asked.plan.world, asked.q_start, asked.margin)
    return f"start in collision: {contact}"


def _goal_in_collision(asked: Asked) -> str:
    goals = asked.goals
    contact = _contact(asked.scene, asked.plan.world, goals.q[0], asked.margin)
    if goals.status is None or goals.given == 1:
        return f"goal in collision: {contact}"
    few = len(goals.blocked)
    outside = f", {goals.given - few} out of limits" if few < goals.given else ""
    return f"{few} goals, all in collision{outside}; the nearest: {contact}"


def _unreachable(asked: Asked) -> str:
    return "no configuration within the limits was found that reaches the pose"


def _out_of_limits(asked: Asked) -> str:
    q_min, q_max, _ = asked.limits
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
    Status.BUDGET_EXHAUSTED: _searched,
    Status.TIME_OUT: _searched,
    Status.START_IN_COLLISION: _start_in_collision,
    Status.GOAL_IN_COLLISION: _goal_in_collision,
    Status.GOAL_UNREACHABLE: _unreachable,
    Status.OUT_OF_LIMITS: _out_of_limits,
    Status.INVALID_INPUT: _not_finite,
}
"""Who finds the words for a status; the others have a path, or nobody asked."""


def _contact(scene: Scene, world: World, q: np.ndarray, margin: float) -> str:
    """What makes q not free, by name: how deep it is, or how near for what it should keep."""
    if not all(np.isfinite(np.asarray(leaf)).all() for leaf in world):
        return "the world has values that are not finite"
    poses = np.concatenate([world.object_pose, world.slot_pose])
    if not poses[:, 3:].any(-1).all():
        return "the world has a quaternion of zeros"
    pair, distance, required = collision.tightest_pair(scene, world, q, margin)
    hint = "" if pair is None else _hint(scene, pair)
    if pair is None:
        return "nothing within 10 mm by C MuJoCo"
    if distance >= 0:
        return (
            f"{pair[0]} and {pair[1]} are {1000 * distance:.2f} mm apart, "
            f"margin {1000 * required:.2f} mm{hint}"
        )
    return f"{pair[0]} and {pair[1]}, {-1000 * distance:.2f} mm deep{hint}"


def _hint(scene: Scene, pair: tuple[str, str]) -> str:
    """What helps where two parts of the robot touch wherever it is."""
    groups = {frozenset(names): group for group, *names in scene.pairs}
    name = groups.get(frozenset(pair), "")
    for group in scene.groups:
        bodies = [side.body for side in group.contacts[0]]
        moved = [scene.structure.moved & {*scene.line(body)} for body in bodies]
        if group.name == name and all(moved):
            a, b = (scene.structure.body_names[body] for body in bodies)
            return f" (if they always touch, Scene.from_mjcf(exclude=[({a!r}, {b!r})]))"
    return ""

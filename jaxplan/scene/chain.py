"""The arm in a kinematic tree: which joints are its own, and where its hand is."""

from collections.abc import Collection, Sequence

import mujoco
import numpy as np

from jaxplan.scene.dependent import Drive, read_drives, turn_to
from jaxplan.scene.names import known

SIMPLE_JOINTS = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
GRIPPER = "gripper", "finger", "jaw"
"""Words in the name of a joint that opens a hand."""


def read_arm(
    model: mujoco.MjModel, names: tuple[str, ...], joints: Sequence[str] | None
) -> tuple[list[int], dict[int, Drive]]:
    """Ids of the arm's joints, and what drives those that are dependent.

    A joint that follows another is the arm's only if that can follow it instead. If
    `joints` is None it is left out otherwise, else refused.

    Args:
        model: The model.
        names: Of joints, by id.
        joints: The arm's.

    Raises:
        ValueError: One of them is not in the model, or cannot be planned for.
    """
    given = arm_joints(model, names) if joints is None else joints
    arm = [names.index(known(name, "joint", names)) for name in given]
    for name, joint in zip(given, arm, strict=True):
        if model.jnt_type[joint] not in SIMPLE_JOINTS:
            raise ValueError(f"joint {name!r} is neither a hinge nor a slide")
        if arm.count(joint) > 1:
            raise ValueError(f"joint {name!r} is given twice")
    drives = read_drives(model, names)
    for joint in [*arm]:
        try:
            drives = turn_to(drives, joint, arm, names)
        except ValueError:
            if joints is not None:
                raise
            arm.remove(joint)
    if not arm:
        raise ValueError("the model has no hinge or slide joint to plan for")
    return arm, drives


def arm_joints(model: mujoco.MjModel, names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the arm's joints, from the world down.

    Where the tree branches, what follows is a hand if no branch has more joints than
    stand above it; else the arm goes on in the longest branch. Joints at the very end
    that are a gripper's by name do not belong to it, nor do those at its start by which
    a base drives over the floor.

    Args:
        model: The model.
        names: Of its joints, by id.

    Raises:
        ValueError: Several branches are longest.
    """
    chains = _longest(model, 0, ())
    if len(chains) > 1:
        arms = [_after_base(model, chain) for chain in chains]
        listed = "; ".join(", ".join(names[j] for j in arm) for arm in arms)
        raise ValueError(
            f"which joints are the arm's? Say joints=[...], for there are {listed}"
        )
    arm = list(chains[0])
    if arm and not _heads(model, model.jnt_bodyid[arm[-1]]):
        while arm and any(word in names[arm[-1]].lower() for word in GRIPPER):
            arm.pop()
    return tuple(names[j] for j in _after_base(model, arm))


def last_body(model: mujoco.MjModel, body: int, following: Collection[int]) -> int:
    """The last body below `body` before another joint or a branch; itself if all is rigid.

    Args:
        model: The model.
        body: Where the arm's last joint is.
        following: Ids of the joints that follow the arm's: they belong to the arm.
    """
    heads = _heads(model, body)
    while len(heads) == 1 and set(simple_joints(model, heads[0])) <= set(following):
        body = heads[0]
        heads = _heads(model, body)
    lines = [set(line(model, model.body_parentid[head])) for head in heads]
    # Ids grow down the tree: the greatest common one is the last before a branch.
    return max(set.intersection(*lines)) if lines else body


def simple_joints(model: mujoco.MjModel, body: int) -> list[int]:
    """Ids of a body's hinges and slides."""
    first = int(model.body_jntadr[body])
    ids = range(first, first + int(model.body_jntnum[body]))
    return [j for j in ids if model.jnt_type[j] in SIMPLE_JOINTS]


def line(model: mujoco.MjModel, body: int) -> list[int]:
    """The body, its parent and so on, without the world."""
    above = []
    while body:
        above.append(int(body))
        body = model.body_parentid[body]
    return above


def _longest(
    model: mujoco.MjModel, body: int, above: tuple[int, ...]
) -> list[tuple[int, ...]]:
    """The longest chains that begin with the joints `above` and go on below the body."""
    heads = _heads(model, body)
    chains = [
        chain
        for head in heads
        for chain in _longest(model, head, (*above, *simple_joints(model, head)))
    ]
    length = max(map(len, chains), default=0)
    driving = _driving(model, above)
    # Fingers on a base that drives are no arm.
    fingers = max(2 * (len(above) - driving), min(driving, 1))
    if not heads or (len(heads) > 1 and length - driving <= fingers):
        return [above]
    return [chain for chain in chains if len(chain) == length]


def _after_base(model: mujoco.MjModel, chain: Sequence[int]) -> Sequence[int]:
    """The chain without the joints that drive a base, unless there are no others."""
    return chain[_driving(model, chain) :] or chain


def _driving(model: mujoco.MjModel, chain: Sequence[int]) -> int:
    """How many joints at the start of a chain drive a base over the floor.

    These are slides without limits, two or more, or exactly two slides, and then a hinge
    across them, unless geoms stand before it: it is a shoulder then.
    """
    slides = 0
    while slides < len(chain) and model.jnt_type[chain[slides]] == SIMPLE_JOINTS[1]:
        slides += 1
    limited = model.jnt_limited[list(chain[:slides])] != 0
    endless = int(limited.argmax()) if limited.any() else slides
    turns = slides == 2 < len(chain)
    if turns:
        axes, bodies = (of[list(chain)] for of in (model.jnt_axis, model.jnt_bodyid))
        across = np.abs(axes[:2] @ axes[2]).max() < 1e-3
        turns = across and (bodies[1] == bodies[2] or not model.body_geomnum[bodies[1]])
    return 3 if turns else endless if endless >= 2 else 0


def _heads(model: mujoco.MjModel, body: int) -> list[int]:
    """Bodies below with a hinge or slide, and none between them and the body."""
    children = [int(b) for b in np.flatnonzero(model.body_parentid == body) if b]
    return [
        head
        for child in children
        for head in ([child] if simple_joints(model, child) else _heads(model, child))
    ]

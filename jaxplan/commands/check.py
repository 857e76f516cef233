"""`jaxplan check`: what planning sees in a model, and what touches in a pose."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from jaxplan.collision import always_touching, closest_pair, tightest_pair
from jaxplan.commands.model import (
    NamedPose,
    chains,
    default_pose,
    read_pose,
    read_scene,
    world_at,
)
from jaxplan.motion.reasons import with_unit
from jaxplan.scene import Scene
from jaxplan.scene.contacts import kind_of

REACH = 0.5
"""How far C MuJoCo looks for what is closest [m]."""
MANY = 8
"""Joints of which more are listed by the chains that they are on."""
SHOWN = 5
"""Pairs of bodies that are listed, besides those that collide."""


def check(
    path: Path,
    at: str | None = None,
    joints: str | None = None,
    hand: str | None = None,
) -> bool:
    """Says what is found in a model.

    Args:
        path: Of the MJCF.
        at: Key frame or numbers; None: `home`, the first key frame or the reference pose.
        joints: See `read_scene`.
        hand: See `read_scene`.

    Returns:
        Whether the pose is free and within limits.

    Raises:
        ValueError: Bad input.
    """
    scene = read_scene(path, joints, hand)
    pose = default_pose(scene) if at is None else read_pose(scene, at, "at")
    _show_scene(path, scene)
    inside = _show_limits(scene, pose)
    free = _show_contacts(scene, pose)
    _suggest_excludes(scene)
    return inside and free


def _show_scene(path: Path, scene: Scene) -> None:
    print(f"{path}: {len(scene.joints)} joints, hand {scene.hand!r}")
    q_min, q_max = np.asarray(scene.q_min), np.asarray(scene.q_max)
    limits = dict(zip(scene.joints, np.stack([q_min, q_max], 1), strict=True))
    for chain in chains(scene, scene.joints):
        if len(scene.joints) > MANY:
            print(f" from {chain.body}:")
        for name in chain.joints:
            print(f"  {name}: {_limits(scene, name, *limits[name])}")
    _show_joints(scene, "other joints", scene.passive)
    follow = getattr(scene, "dependent", ())
    _show_joints(scene, "joints that follow others by an <equality>", follow)
    if scene.objects:
        print(f"objects: {', '.join(scene.objects)}")
    model = scene.mj_model
    touching = {
        geom
        for group in scene.groups
        for contact in group.contacts
        for side in contact
        for geom in side.ids
    }
    kinds = Counter((g in touching, kind_of(model, g)) for g in range(model.ngeom))
    for can, title in ((True, "geoms that can touch"), (False, "geoms left out")):
        counts = [f"{n} {kind}" for (c, kind), n in sorted(kinds.items()) if c == can]
        print(f"{title}: {', '.join(counts) or 'none'}")
    print(f"pairs: {len(scene.pairs)} of geoms, {len(scene.groups)} of bodies")
    for a, b, why in getattr(scene, "excluded", ()):
        print(f"pair left out: {a} and {b}, {why}")


def _limits(scene: Scene, joint: str, low: float, high: float) -> str:
    """A joint's kind, and how far it goes."""
    kind = scene.joint_kind(joint)
    if np.isfinite(low) or np.isfinite(high):
        return f"{kind}, {low:.4f} to {with_unit(scene, joint, high)}"
    round_ = scene.circular[scene.joints.index(joint)]
    return f"{kind}, no limits" + (", goes round" if round_ else "")


def _show_joints(scene: Scene, title: str, names: Sequence[str]) -> None:
    """Names of joints in a line, or many of them in a line for each chain."""
    if len(names) > MANY:
        print(f"{title}:")
        for chain in chains(scene, names):
            print(f"  from {chain.body}: {', '.join(chain.joints)}")
    elif names:
        print(f"{title}: {', '.join(names)}")


def _show_limits(scene: Scene, pose: NamedPose) -> bool:
    """Says which joints are out of their limits; whether none is."""
    over = (pose.q < np.asarray(scene.q_min)) | (pose.q > np.asarray(scene.q_max))
    for joint in np.flatnonzero(over):
        name = scene.joints[joint]
        print(f"out of limits: {name} at {with_unit(scene, name, pose.q[joint])}")
    return not over.any()


def _show_contacts(scene: Scene, pose: NamedPose) -> bool:
    """Lists the closest geoms of each pair of bodies, by C MuJoCo; whether the pose is free."""
    group_of = {frozenset(pair): group for group, *pair in scene.pairs}
    world, nearest = world_at(scene, pose), []
    tight = tightest_pair(scene, world, pose.q, 0.0)
    while len(nearest) < len(scene.groups):
        pair, distance = closest_pair(scene, world, pose.q, REACH)
        if pair is None or (distance >= 0 and len(nearest) >= SHOWN):
            break
        nearest.append((distance, " and ".join(pair)))
        met = scene.ignored([group_of[frozenset(pair)]])
        world = world._replace(ignored=np.asarray(world.ignored) | met)
    deep = sum(distance < 0 for distance, _ in nearest)
    free = tight.pair is None or tight.distance > tight.required
    if deep:
        verdict = f"in collision, {deep} of the pairs of bodies"
    elif not free and tight.pair:
        verdict = (
            f"too near, {' and '.join(tight.pair)}: {1000 * tight.distance:.2f} mm, "
            f"the model's margin is {1000 * tight.required:.2f} mm"
        )
    else:
        verdict = "free"
    print(f"pose {pose.name}: {verdict}")
    for distance, names in nearest:
        print(f"  {1000 * distance:8.2f} mm  {names}")
    return free


def _suggest_excludes(scene: Scene) -> None:
    """Bodies in contact in nearly every pose, as lines for the model's `<contact>`."""
    if touching := always_touching(scene):
        print(
            "in contact in nearly every pose, or never moved against each other by the"
        )
        print("arm; such pairs leave nothing to plan. To leave them out, in <contact>:")
    for group, share in touching:
        body1, body2 = group.split("|")
        print(f'  <exclude body1="{body1}" body2="{body2}"/>  <!-- {share:.0%} -->')

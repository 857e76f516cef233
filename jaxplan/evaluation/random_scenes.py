"""Scenes drawn at random: arms, worlds and contact rules of all kinds, as MJCF.

A tree of 1 to 14 joints, one arm or two, hinges with and without limits, slides, joints that
follow others, fingers, geoms of all kinds on the robot and around it, contact bits, excluded
and listed pairs, margins, slots, and things that can be held or placed.
"""

from typing import NamedTuple

import numpy as np

from jaxplan.collision import Obstacle, World, make_world
from jaxplan.scene import Scene

KINDS = ("sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh")
SLOTS = KINDS[:-1]


class DrawnScene(NamedTuple):
    """A scene as text, and what `Scene.from_mjcf` is told about it."""

    mjcf: str
    joints: tuple[str, ...]
    hand: str
    slots: dict[str, int]
    exclude: list[str]

    def read(self) -> Scene:
        """The scene.

        Raises:
            ValueError: It cannot be planned for.
        """
        return Scene.from_mjcf(*self)


def random_scene(seed: int, most: int = 14) -> DrawnScene:
    """Draws a scene, the same for the same seed, of at most so many joints."""
    return _Maker(seed).scene(most)


def random_world(scene: Scene, rng: np.random.Generator) -> World:
    """Fills some of the slots, places what can be placed, holds some of it."""
    objects = len(scene.objects)
    pose = np.concatenate([_around(rng, objects), _turns(rng, objects)], -1)
    holdable = [
        name not in scene.mocap and name not in scene.bases for name in scene.objects
    ]
    held = np.array(holdable, bool) & (rng.random(objects) < 0.5)
    pose[held, :3] = rng.uniform(-0.1, 0.1, (held.sum(), 3))
    obstacles = [
        Obstacle(
            slot.kind,
            _size(rng, slot.kind, 0.02, 0.15).tolist(),
            [*_around(rng), *turn],
        )
        for slot, turn in zip(scene.slots, _turns(rng, len(scene.slots)), strict=True)
        if rng.random() < 0.7
    ]
    names = [group.name for group in scene.groups]
    ignored = [name for name in names if rng.random() < 0.05]
    passive = rng.uniform(0, 0.03, len(scene.passive))
    return make_world(scene, pose, held, passive, ignored, obstacles)


class _Maker:
    """Text of one scene, drawn part by part."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.kinds = self.rng.choice(KINDS, self.rng.integers(1, 4), replace=False)
        self.bits, self.margins = self.rng.random(2) < 0.3
        self.geoms: list[str] = []
        self.joints: list[str] = []
        self.bodies: list[str] = []
        self.meshes, self.ties = "", ""

    def scene(self, most: int) -> DrawnScene:
        """All of it."""
        rng = self.rng
        count = min(most, int(rng.integers(1, rng.choice([4, 8, 15]))))
        arms = 2 if count > 3 and rng.random() < 0.3 else 1
        shares = np.diff([0, *sorted(rng.integers(1, count, arms - 1)), count])
        world = "".join(
            self.geom(0.05, 0.3, _around(rng)) for _ in range(rng.integers(3))
        )
        if rng.random() < 0.3:
            world += f'<geom name="floor" type="plane" size="1 1 1" pos="0 0 {-0.4}"/>'
        world += "".join(self.arm(int(n), 0.3 * i) for i, n in enumerate(shares))
        hand = str(rng.choice(self.bodies[-2:]))
        for name, joint in (("thing", "<freejoint/>"), ("marker", "")):
            if rng.random() < 0.4:
                mocap = "" if joint else ' mocap="true"'
                parts = joint + self.geom(0.02, 0.06) + self.geom(0.02, 0.06, 0.05)
                place = _text(_around(rng))
                world += f'<body name="{name}" pos="{place}"{mocap}>{parts}</body>'
                self.bodies.append(name)
        contact = ""
        if len(self.bodies) > 1 and rng.random() < 0.4:
            one, other = rng.choice(self.bodies, 2, replace=False)
            contact += f'<exclude body1="{one}" body2="{other}"/>'
        if len(self.geoms) > 1 and rng.random() < 0.3:
            one, other = rng.choice(self.geoms, 2, replace=False)
            contact += f'<pair geom1="{one}" geom2="{other}"/>'
        exclude = ["always_touching"] if rng.random() < 0.8 else []
        if len(self.bodies) > 1 and rng.random() < 0.3:
            exclude.append("|".join(rng.choice(self.bodies, 2, replace=False)))
        kinds = rng.choice(SLOTS, rng.integers(3))
        slots = {str(kind): int(rng.integers(1, 3)) for kind in kinds}
        mjcf = (
            '<mujoco><compiler angle="radian" boundmass="1" boundinertia="1"/>'
            '<default><joint armature="1"/></default>'
            f"<asset>{self.meshes}</asset><worldbody>{world}</worldbody>"
            f"<contact>{contact}</contact><equality>{self.ties}</equality></mujoco>"
        )
        return DrawnScene(mjcf, tuple(self.joints), hand, slots, exclude)

    def arm(self, count: int, aside: float) -> str:
        """A line of bodies with branches, `count` joints in all."""
        rng, parts, below = self.rng, [], []
        while count:
            own = min(count, 1 + int(rng.random() < 0.2))
            parts.append((own, f"b{len(self.bodies)}"))
            self.bodies.append(parts[-1][1])
            count -= own
        for own, name in reversed(parts):
            text = "".join(self.joint() for _ in range(own))
            if len(self.geoms) < 4 or rng.random() < 0.3:
                text += self.geom(0.02, 0.06)
            if rng.random() < 0.1:
                text += self.geom(0.02, 0.04, rng.uniform(-0.1, 0.1, 3))
            branches = rng.random() < 0.15 and len(below) > 1
            inside = below if not branches else below[:1]
            text += "".join(inside) + self.follower(name) + self.finger(name)
            below = [] if not branches else below[1:]
            place, turn = rng.uniform(-0.1, 0.25, 3), rng.normal(size=4)
            if (own, name) == parts[0]:
                place, below = np.array([aside, 0, 0]), [*below]
            body = f'<body name="{name}" pos="{_text(place)}" quat="{_text(turn)}">'
            below.append(f"{body}{text}</body>")
        return "".join(below)

    def joint(self) -> str:
        """One of the arm's."""
        rng, name = self.rng, f"j{len(self.joints)}"
        slides = rng.random() < 0.25
        most = rng.uniform(0.1, 0.4) if slides else rng.uniform(0.5, 4)
        low, high = sorted(rng.uniform(-most, most, 2))
        limits = f'range="{low:.4f} {high + 0.05:.4f}"'
        if rng.random() < (0.05 if slides else 0.3):
            limits = 'limited="false"'
        axis = rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
        place = rng.uniform(-0.1, 0.1, 3) if rng.random() < 0.3 else np.zeros(3)
        ref = rng.uniform(low, high) if rng.random() < 0.2 else 0.0
        self.joints.append(name)
        return (
            f'<joint name="{name}" type="{"slide" if slides else "hinge"}" {limits} '
            f'axis="{_text(axis)}" pos="{_text(place)}" ref="{ref:.4f}"/>'
        )

    def follower(self, body: str) -> str:
        """A part whose joint follows one of the arm's, a telescope or a mimic finger."""
        rng = self.rng
        if rng.random() > 0.1:
            return ""
        kind, name = rng.choice(["slide", "hinge"]), f"follower_{body}"
        degree = rng.choice([1, 1, 2, 3])
        coefficients = np.zeros(5)
        coefficients[: degree + 1] = (
            rng.normal(size=degree + 1) * [0.1, 0.5, 0.2, 0.1][: degree + 1]
        )
        master = rng.choice(self.joints)
        self.ties += f'<joint joint1="{name}" joint2="{master}" polycoef="{_text(coefficients)}"/>'
        return (
            f'<body pos="{_text(rng.uniform(-0.15, 0.15, 3))}"><joint name="{name}" '
            f'type="{kind}" axis="{_text(rng.normal(size=3))}"/>'
            f"{self.geom(0.02, 0.05)}</body>"
        )

    def finger(self, body: str) -> str:
        """A part whose joint is neither the arm's nor follows it."""
        if self.rng.random() > 0.1:
            return ""
        return (
            f'<body pos="{_text(self.rng.uniform(-0.15, 0.15, 3))}"><joint '
            f'name="finger_{body}" type="slide" range="0 0.05"/>'
            f"{self.geom(0.01, 0.03)}</body>"
        )

    def geom(self, least: float, most: float, place: np.ndarray | float = 0.0) -> str:
        """One of the scene's kinds."""
        rng, name = self.rng, f"g{len(self.geoms)}"
        self.geoms.append(name)
        kind = str(rng.choice(self.kinds))
        shape = f'size="{_text(_size(rng, kind, least, most))}"'
        if kind == "mesh":
            corners = rng.normal(size=(rng.integers(4, 9), 3))
            corners *= most / np.linalg.norm(corners, axis=-1, keepdims=True)
            self.meshes += f'<mesh name="{name}" vertex="{_text(corners.ravel())}"/>'
            shape = f'mesh="{name}"'
        if self.bits:
            shape += ' contype="{}" conaffinity="{}"'.format(*rng.integers(0, 4, 2))
        if self.margins and rng.random() < 0.3:
            shape += f' margin="{rng.uniform(0, 0.01):.4f}"'
        position, turn = place * np.ones(3), rng.normal(size=4)
        return (
            f'<geom name="{name}" type="{kind}" {shape} pos="{_text(position)}" '
            f'quat="{_text(turn)}"/>'
        )


def _size(rng: np.random.Generator, kind: str, least: float, most: float) -> np.ndarray:
    """As MuJoCo has it; some are thin."""
    count = {"sphere": 1, "capsule": 2, "cylinder": 2}.get(kind, 3)
    size = rng.uniform(least, most, count)
    if count == 3 and rng.random() < 0.2:
        size[rng.integers(3)] = 0.001
    return size


def _around(rng: np.random.Generator, count: int | None = None) -> np.ndarray:
    """`[3]` or `[count, 3]` places around the origin, not in it [m]."""
    direction = rng.normal(size=3 if count is None else (count, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    away = rng.uniform(0.3, 0.8, () if count is None else (count, 1))
    return direction * away


def _turns(rng: np.random.Generator, count: int) -> np.ndarray:
    turns = rng.normal(size=(count, 4))
    return turns / np.linalg.norm(turns, axis=-1, keepdims=True)


def _text(numbers: np.ndarray) -> str:
    return " ".join(f"{number:.5f}" for number in np.atleast_1d(numbers))

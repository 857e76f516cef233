"""A parametric mug: hollow, with a handle; smooth to look at, a ring of boxes to touch."""

from dataclasses import dataclass

import mujoco
import numpy as np

from jaxplan.scene.surface import Surface

STIFF_CONTACT = {
    # Default contacts let a wall this thin be squeezed out between two pads: the static
    # penetration must stay far below its thickness (methods: r = (1 - d) F T^2 / m < 0.3 mm).
    "solref": [0.005, 1],
    "solimp": [0.99, 0.995, 0.001, 0.5, 2],
    "friction": [1, 0.01, 0.001],
    "condim": 4,
}


@dataclass(frozen=True)
class MugShape:
    """Sizes of the mug [m], its mass [kg] and its colour.

    Its frame has z along the axis from bottom to opening, the origin at mid-height, and the
    handle along +x. Heights of the handle are above the bottom.
    """

    radius: float = 0.040
    height: float = 0.095
    wall: float = 0.004
    bottom: float = 0.005
    sides: int = 16
    mass: float = 0.2
    handle_reach: float = 0.076
    handle_low: float = 0.030
    handle_high: float = 0.078
    handle_width: float = 0.012
    grip_height: float = 0.062
    """Where a hand takes the handle's upright bar."""
    colour: tuple[float, float, float] = (0.16, 0.38, 0.72)
    """Red, green and blue, 0 to 1."""

    @property
    def bar_radius(self) -> float:
        """From the mug's axis to the middle of the handle's upright bar [m]."""
        return self.handle_reach - self.handle_width / 2


def collision_boxes(shape: MugShape) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """The boxes that physics touches, in the mug's frame.

    Returns:
        (name, centre [m], half sizes [m], angle about z [rad]) of each.
    """
    half = shape.height / 2
    middle = shape.radius - shape.wall / 2
    wall = np.array([shape.wall / 2, middle * np.tan(np.pi / shape.sides), half])
    boxes = []
    for k in range(shape.sides):
        angle = 2 * np.pi * k / shape.sides
        centre = np.array([middle * np.cos(angle), middle * np.sin(angle), 0.0])
        boxes.append((f"wall{k}", centre, wall, angle))
    inner = (shape.radius - shape.wall) / np.sqrt(2)
    centre = np.array([0, 0, -half + shape.bottom / 2])
    bottom = np.array([inner, inner, shape.bottom / 2])
    boxes += [
        ("bottom0", centre, bottom, 0.0),
        ("bottom1", centre, bottom, np.pi / 4),
    ]
    bar, low, high, w = _handle(shape)
    start = shape.radius - shape.wall
    x = (bar - w + start) / 2
    upright = np.array([w, w, (high - low) / 2])
    arm = np.array([(bar - w - start) / 2, w, w])
    boxes += [
        ("handle_bar", np.array([bar, 0, (low + high) / 2]), upright, 0.0),
        ("handle_low", np.array([x, 0, low + w]), arm, 0.0),
        ("handle_high", np.array([x, 0, high - w]), arm, 0.0),
    ]
    return boxes


def planning_spheres(shape: MugShape) -> list[tuple[np.ndarray, float]]:
    """Spheres that cover the mug, for a held mug against the world.

    Returns:
        (centre in the mug's frame [m], radius [m]) of each.
    """
    ring, half = shape.radius - 0.006, shape.height / 2
    heights = np.linspace(-half + 0.0095, half - 0.0095, 5)
    # The outside between spheres, and the rim, stick out by 3 mm at most.
    corner = shape.radius / np.cos(np.pi / 24) * np.exp(1j * np.pi / 12)
    beside = max(0.0095, (heights[1] - heights[0]) / 2)
    farthest = np.hypot(abs(corner - ring), beside)
    radius = max(0.012, float(farthest) - 0.003)
    spheres = [
        (np.array([ring * np.cos(angle), ring * np.sin(angle), z]), radius)
        for z in heights
        for angle in 2 * np.pi * np.arange(12) / 12
    ]
    bar, low, high, w = _handle(shape)
    centres = [(bar, z) for z in np.linspace(low + w, high - w, 5)]
    centres += [
        (shape.radius + out, z) for z in (low + w, high - w) for out in (0.008, 0.018)
    ]
    return spheres + [(np.array([x, 0, z]), 0.0105) for x, z in centres]


def planning_geoms(shape: MugShape) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What planning checks of a mug: place in its frame and size [m] of each geom, by name."""
    boxes = {
        f"mug_{name}": (centre, half)
        for name, centre, half, _ in collision_boxes(shape)
    }
    spheres = {
        f"mug_sphere{k}": (centre, np.array([radius, 0, 0]))
        for k, (centre, radius) in enumerate(planning_spheres(shape))
    }
    return boxes | spheres


def add_mug(spec: mujoco.MjSpec, shape: MugShape = MugShape()) -> None:
    """Adds a free body `mug` to the model.

    It has boxes for physics (group 3), spheres for planning (group 4) and what the camera
    sees (group 2).
    """
    body = spec.worldbody.add_body(name="mug", pos=[0.5, 0, shape.height / 2])
    body.add_freejoint(name="mug_joint")
    boxes = collision_boxes(shape)
    volume = sum(np.prod(2 * half) for _, _, half, _ in boxes)
    for name, centre, half, angle in boxes:
        body.add_geom(
            name=f"mug_{name}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=centre,
            quat=[np.cos(angle / 2), 0, 0, np.sin(angle / 2)],
            size=half,
            mass=shape.mass * np.prod(2 * half) / volume,
            group=3,
            contype=1,
            conaffinity=3,
            **STIFF_CONTACT,
        )
    for k, (centre, radius) in enumerate(planning_spheres(shape)):
        body.add_geom(
            name=f"mug_sphere{k}",
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            pos=centre,
            size=[radius, 0, 0],
            mass=0,
            group=4,
            contype=8,
            conaffinity=0,
        )
    for name, surface in {"cup": _cup(shape), "handle": _tube(shape)}.items():
        mesh = spec.add_mesh(
            name=f"mug_{name}_mesh",
            uservert=surface.vertices.ravel(),
            userface=surface.faces.ravel(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        body.add_geom(
            name=f"mug_{name}_visual",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=mesh.name,
            material="mug",
            mass=0,
            group=2,
            contype=0,
            conaffinity=0,
        )


def _handle(shape: MugShape) -> tuple[float, float, float, float]:
    """Of the handle's upright bar: x, lower and upper end, half width [m]."""
    half, w = shape.height / 2, shape.handle_width / 2
    return shape.handle_reach - w, shape.handle_low - half, shape.handle_high - half, w


def _cup(shape: MugShape, sides: int = 48) -> Surface:
    """Surface of revolution of the cup's profile, rim rounded."""
    half, r, w = shape.height / 2, shape.radius, shape.wall
    inner = -half + shape.bottom
    profile = [
        (0, -half),
        (r - 0.003, -half),
        (r - 0.001, -half + 0.001),
        (r, -half + 0.003),
        *(
            (r - w / 2 + w / 2 * np.cos(a), half - w / 2 + w / 2 * np.sin(a))
            for a in np.linspace(0, np.pi, 7)
        ),
        (r - w, inner + 0.004),
        (r - w - 0.004, inner),
        (0, inner),
    ]
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], -1)
    rings = [np.c_[radius * ring, np.full(sides, z)] for radius, z in profile]
    return Surface(np.concatenate(rings), _grid_faces(len(profile), sides))


def _tube(shape: MugShape, steps: int = 24, sides: int = 12) -> Surface:
    """The handle: a rounded square section swept along its centre line."""
    reach, low, high, w = _handle(shape)
    low, high = low + w, high - w
    start = shape.radius - shape.wall
    t = np.linspace(-np.pi / 2, np.pi / 2, steps)
    x = start + (reach - start) * _squarish(np.cos(t))
    z = (low + high) / 2 + (high - low) / 2 * _squarish(np.sin(t))
    line = np.stack([x, 0 * t, z], -1)
    tangent = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([tangent[:, 2], 0 * t, -tangent[:, 0]], -1)
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    section = np.stack([_squarish(np.cos(angles)), _squarish(np.sin(angles))], -1)
    section = w * section * 0.95
    rings = (
        line[:, None]
        + section[None, :, :1] * normal[:, None]
        + section[None, :, 1:] * np.array([0, 1.0, 0])
    )
    return Surface(rings.reshape(-1, 3), _grid_faces(steps, sides))


def _squarish(a: np.ndarray) -> np.ndarray:
    """Turns a circle's sine or cosine into a superellipse's, which is nearly a box."""
    return np.sign(a) * np.abs(a) ** 0.4


def _grid_faces(rings: int, sides: int) -> np.ndarray:
    """Triangles between consecutive closed rings of vertices."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a, b = i * sides + j, i * sides + (j + 1) % sides
    c, d = a + sides, b + sides
    return np.concatenate(
        [np.stack(f, -1).reshape(-1, 3) for f in ((a, b, d), (a, d, c))]
    )

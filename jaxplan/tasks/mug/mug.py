"""A parametric mug: hollow, with a handle; smooth to look at, a ring of boxes to touch."""

from dataclasses import dataclass

import mujoco
import numpy as np

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
    """Sizes of the mug [m]; its frame has z along the axis from bottom to opening, origin at mid-height, handle along +x."""

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

    @property
    def handle_grip(self) -> tuple[float, float]:
        """Radius of the handle's upright bar and height of its grip above the bottom [m]."""
        return self.handle_reach - self.handle_width / 2, 0.062


def collision_boxes(shape: MugShape) -> list[tuple[str, np.ndarray, np.ndarray, float]]:
    """The boxes that physics touches: (name, centre, half sizes, angle about z), in the mug's frame [m, rad]."""
    half = shape.height / 2
    middle = shape.radius - shape.wall / 2
    side = middle * np.tan(np.pi / shape.sides)
    boxes = []
    for k in range(shape.sides):
        angle = 2 * np.pi * k / shape.sides
        centre = np.array([middle * np.cos(angle), middle * np.sin(angle), 0.0])
        boxes.append(
            (f"wall{k}", centre, np.array([shape.wall / 2, side, half]), angle)
        )
    inner = (shape.radius - shape.wall) / np.sqrt(2)
    z_bottom = -half + shape.bottom / 2
    boxes.append(
        (
            "bottom0",
            np.array([0, 0, z_bottom]),
            np.array([inner, inner, shape.bottom / 2]),
            0.0,
        )
    )
    boxes.append(
        (
            "bottom1",
            np.array([0, 0, z_bottom]),
            np.array([inner, inner, shape.bottom / 2]),
            np.pi / 4,
        )
    )
    w = shape.handle_width / 2
    bar_x, low, high = (
        shape.handle_reach - w,
        shape.handle_low - half,
        shape.handle_high - half,
    )
    boxes.append(
        (
            "handle_bar",
            np.array([bar_x, 0, (low + high) / 2]),
            np.array([w, w, (high - low) / 2]),
            0.0,
        )
    )
    start = shape.radius - shape.wall
    arm = np.array([(bar_x - w - start) / 2, w, w])
    x = (bar_x - w + start) / 2
    boxes.append(("handle_low", np.array([x, 0, low + w]), arm, 0.0))
    boxes.append(("handle_high", np.array([x, 0, high - w]), arm, 0.0))
    return boxes


def planning_spheres(shape: MugShape) -> list[tuple[np.ndarray, float]]:
    """Spheres that cover the mug, for a held mug against the world: (centre in the mug's frame, radius) [m]."""
    ring_radius, r, half = shape.radius - 0.006, 0.012, shape.height / 2
    spheres = []
    for z in np.linspace(-half + 0.0095, half - 0.0095, 5):
        for angle in 2 * np.pi * np.arange(12) / 12:
            spheres.append(
                (
                    np.array(
                        [ring_radius * np.cos(angle), ring_radius * np.sin(angle), z]
                    ),
                    r,
                )
            )
    w = shape.handle_width / 2
    bar, low, high = (
        shape.handle_reach - w,
        shape.handle_low - half,
        shape.handle_high - half,
    )
    for z in np.linspace(low + w, high - w, 5):
        spheres.append((np.array([bar, 0, z]), 0.0105))
    for z in (low + w, high - w):
        for x in (shape.radius + 0.008, shape.radius + 0.018):
            spheres.append((np.array([x, 0, z]), 0.0105))
    return spheres


def add_mug(spec: mujoco.MjSpec, shape: MugShape = MugShape()) -> None:
    """Adds a free body `mug` to the model: physics boxes (group 3), planning boxes (group 4) and what the camera sees (group 2)."""
    body = spec.worldbody.add_body(name="mug", pos=[0.5, 0, shape.height / 2])
    body.add_freejoint(name="mug_joint")
    boxes = collision_boxes(shape)
    volume = sum(np.prod(2 * half) for _, _, half, _ in boxes)
    for name, centre, half, angle in boxes:
        placement = {
            "pos": centre,
            "quat": [np.cos(angle / 2), 0, 0, np.sin(angle / 2)],
        }
        body.add_geom(
            name=f"mug_{name}", type=mujoco.mjtGeom.mjGEOM_BOX, size=half, group=3,
            mass=shape.mass * np.prod(2 * half) / volume, contype=1, conaffinity=3,
            **placement, **STIFF_CONTACT,
        )  # fmt: skip
    for k, (centre, radius) in enumerate(planning_spheres(shape)):
        body.add_geom(
            name=f"mug_sphere{k}", type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], pos=centre, group=4,
            mass=0, contype=8, conaffinity=0,
        )  # fmt: skip
    cup, handle = _cup_mesh(shape), _handle_mesh(shape)
    for name, (vertices, faces) in {"cup": cup, "handle": handle}.items():
        mesh = spec.add_mesh(name=f"mug_{name}_mesh")
        mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        body.add_geom(
            name=f"mug_{name}_visual", type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name,
            contype=0, conaffinity=0, group=2, mass=0, material="mug",
        )  # fmt: skip


def _cup_mesh(shape: MugShape, sides: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Surface of revolution of the cup's profile, rim rounded."""
    half, r, w = shape.height / 2, shape.radius, shape.wall
    rim = [
        (r - w / 2 + w / 2 * np.cos(a), half - w / 2 + w / 2 * np.sin(a))
        for a in np.linspace(0, np.pi, 7)
    ]
    profile = [
        (0, -half),
        (r - 0.003, -half),
        (r - 0.001, -half + 0.001),
        (r, -half + 0.003),
    ]
    profile += [
        *rim,
        (r - w, -half + shape.bottom + 0.004),
        (r - w - 0.004, -half + shape.bottom),
        (0, -half + shape.bottom),
    ]
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.stack([np.cos(angles), np.sin(angles)], -1)
    vertices = np.concatenate(
        [np.c_[radius * ring, np.full(sides, z)] for radius, z in profile]
    )
    return vertices, _grid_faces(len(profile), sides)


def _handle_mesh(
    shape: MugShape, steps: int = 24, sides: int = 12
) -> tuple[np.ndarray, np.ndarray]:
    """A tube with a rounded square section swept along the handle's centre line."""
    half, w = shape.height / 2, shape.handle_width / 2
    low, high = shape.handle_low - half + w, shape.handle_high - half - w
    start, reach = shape.radius - shape.wall, shape.handle_reach - w
    t = np.linspace(-np.pi / 2, np.pi / 2, steps)
    curve = lambda a: np.sign(a) * np.abs(a) ** 0.4  # noqa: E731 (superellipse: nearly the boxes)
    line = np.stack(
        [
            start + (reach - start) * curve(np.cos(t)),
            0 * t,
            (low + high) / 2 + (high - low) / 2 * curve(np.sin(t)),
        ],
        -1,
    )
    tangent = np.gradient(line, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([tangent[:, 2], 0 * t, -tangent[:, 0]], -1)
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    section = w * np.stack([curve(np.cos(angles)), curve(np.sin(angles))], -1) * 0.95
    rings = (
        line[:, None]
        + section[None, :, :1] * normal[:, None]
        + section[None, :, 1:] * np.array([0, 1.0, 0])
    )
    return rings.reshape(-1, 3), _grid_faces(steps, sides)


def _grid_faces(rings: int, sides: int) -> np.ndarray:
    """Triangles between consecutive closed rings of vertices."""
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    a, b = i * sides + j, i * sides + (j + 1) % sides
    c, d = a + sides, b + sides
    return np.concatenate(
        [np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)]
    )

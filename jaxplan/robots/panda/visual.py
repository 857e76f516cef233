"""The Panda's looks: lofted shells, lathed rings and boxes of our own, never touched by physics.

Shapes are given in the frames of `panda.xml` [m]. The arm is built of two shells used twice, as
on the real robot: one half of the shoulder (link1, link2) and one half of the elbow (link3,
link4), each a bent tube which ends on its joint's axis next to its twin.
"""

import mujoco

from jaxplan.scene.surface import Surface, box, join, lathe, loft, turn

MATERIALS = {
    "white": ((0.93, 0.94, 0.95, 1), 0.5, 0.7),
    "dark": ((0.16, 0.17, 0.18, 1), 0.3, 0.4),
    "grey": ((0.42, 0.44, 0.46, 1), 0.4, 0.5),
    "aluminium": ((0.74, 0.75, 0.77, 1), 0.6, 0.6),
    "rubber": ((0.10, 0.10, 0.11, 1), 0.1, 0.1),
}
"""RGBA, specular and shininess of each."""


def add_visuals(spec: mujoco.MjSpec) -> None:
    """Adds geoms of group 2 without mass or contacts to the Panda's bodies in `spec`.

    Args:
      spec: holds the bodies of `panda.xml`; changed in place.
    """
    for name, (rgba, specular, shininess) in MATERIALS.items():
        spec.add_material(
            name=f"panda_{name}", rgba=rgba, specular=specular, shininess=shininess
        )
    for body, parts in _robot().items():
        for material in dict.fromkeys(name for name, _ in parts):
            surface = join([part for name, part in parts if name == material])
            mesh = f"panda_{body}_{material}"
            spec.add_mesh(
                name=mesh,
                uservert=surface.vertices.ravel(),
                userface=surface.faces.ravel(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            spec.body(body).add_geom(
                name=f"{body}_{material}_visual",
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=mesh,
                material=f"panda_{material}",
                group=2,
                contype=0,
                conaffinity=0,
                mass=0,
            )


def _robot() -> dict[str, list[tuple[str, Surface]]]:
    """The parts of each body, as (material, surface)."""
    shoulder, elbow = loft(_SHOULDER, "yzx"), loft(_ELBOW, "yzx")
    finger = [("aluminium", loft(_FINGER, "yzx", 1, 12)), ("rubber", box(*_PAD))]
    return {
        "link0": [
            ("white", loft(_BASE, "xzy")),
            ("dark", lathe([(0.056, 0.135), (0.056, 0.146)], "z")),
            ("dark", box((-0.134, 0, 0.032), (0.0055, 0.050, 0.020))),
            ("grey", box((-0.139, 0.03, 0.032), (0.003, 0.012, 0.012))),
            ("grey", box((-0.139, -0.02, 0.032), (0.003, 0.02, 0.014))),
        ],
        "link1": [("white", shoulder), ("dark", lathe(_AXLE, "y"))],
        "link2": [
            ("white", turn(shoulder, [[1, 0, 0], [0, 0, 1], [0, -1, 0]])),
            ("dark", lathe([(0.056, -0.196), (0.056, -0.186)], "y")),
        ],
        "link3": [
            ("white", elbow),
            ("dark", lathe(_AXLE, "y", (0.0825, 0, 0))),
        ],
        "link4": [
            ("white", turn(elbow, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], -0.0825)),
            ("dark", lathe([(0.056, 0.117), (0.056, 0.13)], "y", (-0.0825, 0, 0))),
        ],
        "link5": [
            ("white", loft(_FOREARM, "yzx")),
            ("dark", lathe([(0.044, 0.044), (0.044, 0.056)], "y")),
        ],
        "link6": [
            ("white", lathe(_WRIST_DISC, "z")),
            ("white", lathe(_WRIST_DRUM, "y", (0.088, 0, 0))),
            ("white", loft(_WRIST_BRIDGE, "yxz", 1, 16)),
            ("grey", lathe([(0.036, 0.05), (0.034, 0.053)], "z")),
            ("dark", lathe([(0.042, -0.055), (0.042, -0.045)], "y", (0.088, 0, 0))),
        ],
        "link7": [
            ("white", lathe(_FLANGE_DRUM, "z")),
            ("white", loft(_PILOT, "zxy", 1, 20)),
            ("grey", lathe([(0.0315, 0.09), (0.0315, 0.107)], "z")),
            ("dark", lathe([(0.014, 0.08), (0.014, 0.0845)], "x", (0, 0, 0.079))),
        ],
        "hand": [
            ("white", loft(_HAND, "zyx", 1, 20)),
            ("grey", lathe([(0.036, 0.0), (0.036, 0.008), (0.033, 0.014)], "z")),
            ("dark", box((0, 0, 0.0655), (0.0125, 0.086, 0.0012))),
            ("dark", box((0.061, -0.024, -0.015), (0.012, 0.036, 0.0115))),
            ("grey", box((0.04, -0.012, -0.006), (0.012, 0.014, 0.003))),
        ],
        "left_finger": finger,
        "right_finger": finger,
    }


# A loft's stations: the section's two ends (a, b) and (c, d) in the plane of symmetry, its half
# width, then optionally its shift along the width and its squareness (2 is an ellipse).
_BASE = [
    (-0.137, 0.000, 0.071, 0.000, 0.094, 0, 4.5),
    (-0.137, 0.022, 0.071, 0.022, 0.092, 0, 4.5),
    (-0.134, 0.058, 0.068, 0.050, 0.080, 0, 3.5),
    (-0.112, 0.088, 0.063, 0.075, 0.066, 0, 2.5),
    (-0.072, 0.112, 0.060, 0.105, 0.060, 0, 2.0),
    (-0.059, 0.138, 0.059, 0.138, 0.059, 0, 2.0),
]
_SHOULDER = [
    (0.058, -0.190, -0.058, -0.190, 0.058),
    (0.058, -0.140, -0.058, -0.140, 0.058),
    (0.052, -0.094, -0.074, -0.078, 0.058),
    (0.024, -0.069, -0.116, -0.020, 0.059),
    (0.008, -0.064, -0.112, 0.036, 0.060),
    (0.002, -0.061, -0.070, 0.060, 0.060),
    (-0.002, -0.060, -0.002, 0.060, 0.060),
]
_ELBOW = [
    (0.058, -0.121, -0.058, -0.121, 0.058, 0.0),
    (0.058, -0.100, -0.060, -0.093, 0.061, 0.004),
    (0.050, -0.078, -0.084, -0.052, 0.069, 0.024),
    (0.022, -0.066, -0.114, -0.002, 0.068, 0.058),
    (0.008, -0.063, -0.108, 0.038, 0.063, 0.076),
    (0.002, -0.061, -0.070, 0.060, 0.060, 0.0825),
    (-0.002, -0.060, -0.002, 0.060, 0.060, 0.0825),
]
_FOREARM = [
    (-0.058, -0.257, 0.058, -0.257, 0.058),
    (-0.057, -0.215, 0.061, -0.215, 0.058),
    (-0.040, -0.165, 0.081, -0.160, 0.054, 0, 2.2),
    (0.005, -0.115, 0.098, -0.100, 0.049, 0, 2.5),
    (0.044, -0.055, 0.105, -0.050, 0.048, 0, 2.8),
    (0.053, 0.000, 0.105, 0.000, 0.048, 0, 3.0),
    (0.053, 0.030, 0.102, 0.030, 0.038, 0, 3.0),
    (0.055, 0.046, 0.094, 0.046, 0.015, 0, 2.5),
]
_WRIST_BRIDGE = [
    (-0.040, -0.005, 0.044, -0.005, 0.044, 0, 3.5),
    (-0.040, 0.045, 0.046, 0.045, 0.043, 0, 3.0),
    (-0.045, 0.095, 0.047, 0.095, 0.040, 0, 3.0),
]
_FINGER = [
    (0.001, 0.000, 0.021, 0.000, 0.0105, 0, 8),
    (0.001, 0.019, 0.021, 0.019, 0.0105, 0, 8),
    (0.007, 0.026, 0.019, 0.026, 0.0100, 0, 8),
    (0.007, 0.038, 0.016, 0.038, 0.0090, 0, 8),
    (0.007, 0.053, 0.0125, 0.053, 0.0085, 0, 8),
]
_HAND = [
    (0.028, -0.102, 0.056, -0.102, 0.016, 0, 4),
    (0.018, -0.099, 0.063, -0.099, 0.025, 0, 4),
    (0.012, -0.088, 0.066, -0.088, 0.030, 0, 5),
    (0.004, -0.050, 0.066, -0.050, 0.0315, 0, 5),
    (0.002, 0.000, 0.066, 0.000, 0.0315, 0, 5),
]
_HAND += [(a, -b, c, -d, *rest) for a, b, c, d, *rest in _HAND[-2::-1]]
_PILOT = [
    (0.058, 0.000, 0.100, 0.000, 0.040, 0, 3),
    (0.058, 0.045, 0.100, 0.045, 0.033, 0, 3),
    (0.060, 0.070, 0.098, 0.070, 0.027, 0, 3),
    (0.063, 0.083, 0.095, 0.083, 0.022, 0, 3),
]
# A lathe's profile: radius and height.
_AXLE = [(0.0575, -0.004), (0.0575, 0.004)]
_WRIST_DISC = [
    (0.044, -0.048), (0.050, -0.042), (0.050, 0.040), (0.047, 0.047), (0.040, 0.051),
]  # fmt: skip
_WRIST_DRUM = [
    (0.046, -0.047), (0.046, 0.036), (0.043, 0.046), (0.035, 0.052), (0.020, 0.055),
]  # fmt: skip
_FLANGE_DRUM = [(0.043, 0.053), (0.045, 0.058), (0.045, 0.092), (0.041, 0.100)]
_PAD = (0, 0.004, 0.0445), (0.0085, 0.004, 0.0085)

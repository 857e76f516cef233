"""The mug scene: Panda, table, mug, target box, cameras; a model for physics, one for planning."""

from functools import cache
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from jaxplan.robots import PANDA
from jaxplan.tasks.look import AWAY, DISTRACTOR, TEXTURED
from jaxplan.tasks.mug.clutter import CLUTTERED
from jaxplan.tasks.mug.mug import STIFF_CONTACT, MugShape, add_mug
from jaxplan.tasks.mug.variant import Variant, add_obstacles
from jaxplan.tasks.mug.ways import WAYS

BOX_INNER, BOX_WALL, BOX_HEIGHT, BOX_FLOOR = 0.085, 0.005, 0.04, 0.004
"""Of the target box: half of the inner side, half of the wall's thickness, height and floor
thickness [m]."""

IMAGE_HEIGHT, IMAGE_WIDTH = PANDA.mount.height, PANDA.mount.width

Kind = Literal["physics", "planning"]
VARIANTS = {"plain": Variant(), "cluttered": CLUTTERED, "ways": WAYS}

PHYSICS = {"group": 3, "contype": 1, "conaffinity": 3}
PLANNING = {"group": 4, "contype": 4, "conaffinity": 12}
VISUAL = {"group": 2, "contype": 0, "conaffinity": 0}
"""Whose a geom of the surroundings is: what physics touches, planning checks, a camera sees."""


def build(
    kind: Kind = "physics",
    shape: MugShape = MugShape(),
    variant: str = "plain",
) -> mujoco.MjModel:
    """Compiles the scene; `kind` says whose geoms collide.

    What physics touches (a ring of boxes, a few hulls) is in group 3, what planning checks
    (the arm's spheres among others) in group 4, and what only the camera sees in group 2.
    """
    return spec(kind, shape, variant).compile()


def look(shape: MugShape = MugShape(), variant: str = "plain") -> mujoco.MjModel:
    """How the scene of physics looks, with a textured table and a distractor for who asks for them.

    Joints are those of physics.
    """
    scene = spec("physics", shape, variant)
    scene.add_texture(
        name=TEXTURED,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.9, 0.9, 0.9],
        rgb2=[0.55, 0.55, 0.55],
        width=256,
        height=256,
    )
    textured = scene.add_material(
        name=TEXTURED, rgba=[0.76, 0.67, 0.54, 1], specular=0.1, texrepeat=[12, 12]
    )
    textured.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = TEXTURED
    scene.add_material(name=DISTRACTOR, rgba=[0.75, 0.2, 0.15, 1], specular=0.3)
    thing = scene.worldbody.add_body(name=DISTRACTOR, pos=AWAY, mocap=True)
    can, block = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX
    for kind, size, pos in (
        (can, [0.033, 0.06, 0], [0, 0, 0.06]),
        (block, [0.05, 0.03, 0.02], [0.08, 0, 0.02]),
    ):
        thing.add_geom(type=kind, size=size, pos=pos, material=DISTRACTOR, **VISUAL)
    return scene.compile()


def spec(
    kind: Kind = "physics",
    shape: MugShape = MugShape(),
    variant: str = "plain",
) -> mujoco.MjSpec:
    """The scene before compilation.

    Raises:
        ValueError: There is no such variant.
    """
    if variant not in VARIANTS:
        raise ValueError(f"variant {variant!r}: {' or '.join(VARIANTS)}")
    scene = _surroundings(kind, variant).copy()
    scene.material("mug").rgba = [*shape.colour, 1]
    add_mug(scene, shape)
    for geom in list(scene.body("mug").geoms):
        if kind == "planning" and geom.group == 3:
            # The mug's boxes serve both: against the robot they are exact where a finger enters.
            geom.group, geom.contype, geom.conaffinity = 4, 16, 0
        elif kind == "physics" and geom.group == 4:
            scene.delete(geom)
    _add_cameras(scene)
    home = [*PANDA.q_home, *PANDA.fingers * [PANDA.gripper.open]]
    mug = [0.5, 0, shape.height / 2, 1, 0, 0, 0]
    scene.add_key(name="home", qpos=[*home, *mug], ctrl=home)
    return scene


@cache
def _surroundings(kind: Kind, variant: str) -> mujoco.MjSpec:
    """All but the mug, made once: it takes several times as long as a mug."""
    layout = VARIANTS[variant]
    scene = PANDA.spec()
    scene.modelname = f"mug_{kind}"
    option = scene.option
    option.timestep = 0.002
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 20
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    _add_look(scene)
    _add_table(scene)
    _add_box(scene, layout.box)
    if layout.obstacles:
        looks = PHYSICS | STIFF_CONTACT, PLANNING, VISUAL
        add_obstacles(scene, layout.obstacles, *looks)
    for geom in list(scene.geoms):
        if geom.group == (4 if kind == "physics" else 3):
            scene.delete(geom)
    return scene


def _add_look(scene: mujoco.MjSpec) -> None:
    """Light, materials, and the two settings that make software rendering 50 times faster."""
    scene.visual.quality.shadowsize = 1024
    scene.visual.quality.offsamples = 0
    scene.visual.global_.offwidth, scene.visual.global_.offheight = 1280, 960
    scene.visual.headlight.ambient = [0.35, 0.35, 0.35]
    scene.visual.headlight.diffuse = [0.35, 0.35, 0.35]
    scene.visual.headlight.specular = [0.1, 0.1, 0.1]
    scene.add_material(name="mug", specular=0.5, shininess=0.6)
    scene.add_material(name="table", rgba=[0.76, 0.67, 0.54, 1], specular=0.1)
    scene.add_material(name="box", rgba=[0.30, 0.55, 0.34, 1], specular=0.1)
    scene.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.92, 0.94, 0.96],
        rgb2=[0.62, 0.68, 0.74],
        width=64,
        height=384,
    )
    scene.worldbody.add_light(
        pos=[0.6, -0.8, 1.8],
        dir=[-0.2, 0.8, -1.6],
        diffuse=[0.5, 0.5, 0.5],
        castshadow=True,
    )


def _add_table(scene: mujoco.MjSpec) -> None:
    plane = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": [0, 0, 0.1], **STIFF_CONTACT}
    scene.worldbody.add_geom(name="table", **plane, **PHYSICS)
    scene.worldbody.add_geom(name="table_planning", **plane, **PLANNING)
    scene.worldbody.add_geom(
        name="table_visual",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[0.55, 0.75, 0.02],
        pos=[0.35, 0, -0.0205],
        material="table",
        **VISUAL,
    )


def _add_box(scene: mujoco.MjSpec, position: ArrayLike) -> None:
    body = scene.worldbody.add_body(name="box", pos=position)
    outer, middle = BOX_INNER + 2 * BOX_WALL, BOX_INNER + BOX_WALL
    z, h = BOX_FLOOR + BOX_HEIGHT / 2, BOX_HEIGHT / 2
    parts = {
        "floor": ([0, 0, BOX_FLOOR / 2], [outer, outer, BOX_FLOOR / 2]),
        "front": ([middle, 0, z], [BOX_WALL, outer, h]),
        "back": ([-middle, 0, z], [BOX_WALL, outer, h]),
        "left": ([0, middle, z], [BOX_INNER, BOX_WALL, h]),
        "right": ([0, -middle, z], [BOX_INNER, BOX_WALL, h]),
    }
    for name, (pos, size) in parts.items():
        part = {"type": mujoco.mjtGeom.mjGEOM_BOX, "pos": pos, "size": size}
        look = {"material": "box"}
        body.add_geom(name=f"box_{name}", **part, **look, **PHYSICS, **STIFF_CONTACT)
        body.add_geom(name=f"box_{name}_planning", **part, **PLANNING)
        body.add_geom(name=f"box_{name}_visual", **part, **look, **VISUAL)


def _add_cameras(scene: mujoco.MjSpec) -> None:
    """Adds `hand`, on the wrist, looking past the fingers, and `static`, in front of the table."""
    mount = PANDA.mount
    scene.body(PANDA.hand).add_camera(
        name="hand",
        pos=mount.position,
        fovy=mount.fovy,
        quat=_camera_quat(
            forward=[-np.sin(mount.tilt), 0, np.cos(mount.tilt)], up=[-1, 0, 0]
        ),
    )
    target, eye = np.array([0.3, -0.05, 0.22]), np.array([1.5, -0.85, 0.9])
    scene.worldbody.add_camera(
        name="static", pos=eye, fovy=45, quat=_camera_quat(target - eye, up=[0, 0, 1])
    )


def _camera_quat(forward: ArrayLike, up: ArrayLike) -> np.ndarray:
    """Orientation of a MuJoCo camera (looks along -z, y up) that looks along `forward`."""
    z = -np.asarray(forward, float) / np.linalg.norm(forward)
    x = np.cross(np.asarray(up, float), z)
    x /= np.linalg.norm(x)
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, np.stack([x, np.cross(z, x), z], 1).ravel())
    return quat

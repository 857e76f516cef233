"""From a URDF to an MjSpec: what MuJoCo's own reader takes, and what it gets wrong.

MuJoCo reads links, joints, limits and mimic joints. It looks for all meshes in one folder,
takes two of one file name for one mesh, stops at visuals that it cannot draw, merges links
that no joint moves, and wants masses. So paths are resolved here, as ROS does it, and only
what planning needs is handed on: shapes for collisions, every link under its own name.
"""

from collections import Counter
from os import PathLike
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.parsers import expat

import mujoco

MESHES = ".stl", ".obj", ".msh"
"""What MuJoCo can read."""
COMPILER = {
    "strippath": "false",
    "fusestatic": "false",
    "inertiafromgeom": "false",
    "balanceinertia": "true",
    "boundmass": "1e-3",
    "boundinertia": "1e-6",
}
"""Planning does not weigh: links may lack a mass, as frames of tools do."""


def read_urdf(
    path: str | PathLike, meshes: str | PathLike | None = None
) -> mujoco.MjSpec:
    """The robot, with its root link fixed to the world.

    Args:
        path: Of the URDF.
        meshes: A folder of packages, a package or a folder of mesh files, in which mesh
            paths are looked for first. None: the URDF's own folder and those above it.

    Raises:
        FileNotFoundError: There is no such file, or a mesh that is not found, by its path.
        ValueError: It is no URDF, a mesh is of a kind that MuJoCo cannot read, or a mimic
            joint follows one that does not exist.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"no such file: {path}")
    robot = parse(path, "robot")
    for link in robot.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    _check_mimics(path, robot)
    _drop_repeated_names(robot)
    assets: dict[str, bytes] = {}
    keys: dict[Path, str] = {}
    for mesh in robot.iter("mesh"):
        file = _resolve(mesh.get("filename", ""), path, meshes)
        if file.suffix.lower() not in MESHES:
            raise ValueError(
                f"{path}: MuJoCo reads {', '.join(MESHES)}, so this mesh needs to be "
                f"converted: {file}"
            )
        key = keys.setdefault(file, f"{len(keys)}_{file.name}")
        assets[key] = file.read_bytes()
        mesh.set("filename", key)
    for own in robot.findall("mujoco"):
        robot.remove(own)
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", COMPILER)
    try:
        return mujoco.MjSpec.from_string(
            ET.tostring(robot, encoding="unicode"), assets=assets
        )
    except ValueError as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None


def parse(path: Path, tag: str) -> ET.Element:
    """The root of an XML file.

    Args:
        path: Of the file.
        tag: Of the root, as expected.

    Raises:
        ValueError: It is no XML, another kind of file, or has macros in it.
    """
    # Not ET.parse: it wants namespaces, which robots use without declaring them.
    reader, tree = expat.ParserCreate(), ET.TreeBuilder()
    reader.StartElementHandler, reader.EndElementHandler = tree.start, tree.end
    try:
        reader.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        raise ValueError(f"{path}: {error}") from None
    root = tree.close()
    if root.tag != tag:
        raise ValueError(f"{path}: expected <{tag}>, found <{root.tag}>")
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        raise ValueError(f"{path}: xacro macros are not expanded; run xacro first")
    return root


def _check_mimics(path: Path, robot: ET.Element) -> None:
    """MuJoCo leaves out a mimic of an unknown joint, and the joint would be free."""
    joints = {joint.get("name") for joint in robot.findall("joint")}
    for joint in robot.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None and mimic.get("joint") not in joints:
            raise ValueError(
                f"{path}: joint {joint.get('name')!r} mimics {mimic.get('joint')!r}, "
                "which does not exist"
            )


def _drop_repeated_names(robot: ET.Element) -> None:
    """Collision shapes may share a name in a URDF, geoms may not."""
    shapes = list(robot.iter("collision"))
    counts = Counter(shape.get("name") for shape in shapes)
    for shape in shapes:
        if counts[shape.get("name")] > 1:
            shape.attrib.pop("name", None)


def _resolve(name: str, urdf: Path, meshes: str | PathLike | None) -> Path:
    """The file of a mesh.

    `package://arm/meshes/a.stl` is `arm/meshes/a.stl` in a folder of packages, or
    `meshes/a.stl` in the package; other paths are seen from the URDF.
    """
    scheme, _, rest = name.rpartition("://")
    inside = rest.lstrip("/").partition("/")[2]
    tails = [rest.lstrip("/"), inside] if scheme in ("package", "model") else [rest]
    folders = [urdf.absolute().parent, *urdf.absolute().parent.parents]
    if meshes is not None:
        folders = [Path(meshes).absolute(), *folders]
        tails.append(Path(rest).name)
    paths = [folder / tail for folder in folders for tail in tails if tail]
    found = next((file for file in paths if file.is_file()), None)
    if found is None:
        raise FileNotFoundError(
            f"{urdf}: no mesh {name!r} in {folders[0]} and above it; say meshes=FOLDER"
        )
    return found

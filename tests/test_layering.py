"""The package's layers, read from its imports."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import jaxplan

PACKAGE = Path(jaxplan.__file__).parent

# Each part may import itself and what stands in an earlier line.
LAYERS = (
    {"base", "interrupt", "process", "ranges"},
    {"config", "episodes", "provenance"},
    {"scene", "planning", "trajectory", "diffusion"},
    {"collision", "robots"},
    {"data", "ik", "networks", "simulation"},
    {"learning", "motion"},
    {"policies", "samplers"},
    {"pretrained", "tasks"},
    {"algorithm1"},
    {"cells", "demonstrations", "learned", "pictures", "trainings"},
    {"evaluation"},
    {"commands", "solve", "train", "__init__"},
    {"cli"},
    {"__main__"},
)
LAYER = {part: i for i, parts in enumerate(LAYERS) for part in parts}

# Libraries that only some parts may know.
HOMES = {
    "flax": ("networks/",),
    "mujoco": ("scene/", "collision/", "simulation/", "robots/", "tasks/", "pictures/"),
    "orbax": ("learning/checkpoint.py",),
}
OUTSIDE = {"train", "eval", "configs", "tests"}
PRINTING = (
    "cli.py",
    "commands/check.py",
    "commands/plan.py",
    "commands/record.py",
    "solve.py",
    "train.py",
)

FILES = sorted(file.relative_to(PACKAGE).as_posix() for file in PACKAGE.rglob("*.py"))


def part_of(file: str) -> str:
    return file.split("/")[0].removesuffix(".py")


def tree_of(file: str) -> ast.Module:
    return ast.parse((PACKAGE / file).read_text(encoding="utf-8"))


def imports(file: str) -> Iterator[str]:
    """Every imported name with its dots, wherever in the file it stands."""
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}:{node.lineno} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_every_part_has_a_layer():
    assert {part_of(file) for file in FILES} <= set(LAYER)


@pytest.mark.parametrize("file", FILES)
def test_imports_point_to_earlier_layers(file):
    part = part_of(file)
    for name in imports(file):
        library, *rest = name.split(".")
        if library != "jaxplan":
            continue
        used = rest[0] if rest and rest[0] in LAYER else "__init__"
        if (used, rest) == ("__init__", ["__version__"]):
            continue  # a constant, not a part
        assert used == part or LAYER[used] < LAYER[part], f"{part} imports {used}"


@pytest.mark.parametrize("file", FILES)
def test_libraries_stay_at_home(file):
    for name in imports(file):
        library = name.split(".")[0]
        assert library not in OUTSIDE, f"{file} imports {name}"
        homes = HOMES.get(library)
        assert homes is None or file.startswith(homes), f"{file} imports {name}"


@pytest.mark.parametrize("file", FILES)
def test_only_doors_print(file):
    calls = (node for node in ast.walk(tree_of(file)) if isinstance(node, ast.Call))
    printing = [
        node.lineno
        for node in calls
        if isinstance(node.func, ast.Name) and node.func.id == "print"
    ]
    assert file in PRINTING or not printing, f"{file} prints in lines {printing}"


def test_every_layer_is_there():
    there = {part_of(file) for file in FILES}
    assert {*LAYER} == there

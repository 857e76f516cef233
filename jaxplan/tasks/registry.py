"""The tasks by name: `load("mug", batch=32, variant="cluttered")`."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from jaxplan import ranges
from jaxplan.robots import PANDA
from jaxplan.tasks.mug.mugs import RANGES, described
from jaxplan.tasks.mug.poses import STARTS
from jaxplan.tasks.mug.scene import VARIANTS
from jaxplan.tasks.mug.task import MugTask
from jaxplan.tasks.perturbation import NOMINAL, Perturbation
from jaxplan.tasks.starts import Starts
from jaxplan.tasks.tabletop import ONE, Tabletop, full_name


class TaskEntry(NamedTuple):
    """How a task is made."""

    make: Callable[..., Tabletop]
    """(batch, variant=..., camera=..., friction=..., perturbation=..., objects=...)."""
    variants: tuple[str, ...]
    """Of its scene; the first is the plain one."""
    robot: str
    """Whose arm it is for."""
    starts: Starts | None = None
    """What is drawn at random at the start of an episode."""
    objects: Mapping[str, Mapping[str, str]] = {ONE: {}}
    """Which objects its episodes may have: by name what is drawn, for cards of data sets."""


TASKS = {
    "mug": TaskEntry(
        MugTask,
        tuple(VARIANTS),
        PANDA.name,
        STARTS,
        {ONE: {}} | {name: described(name) for name in RANGES},
    )
}


DEFAULT = "mug"
"""The paper's."""


def names() -> list[str]:
    """Of all tasks."""
    return sorted(TASKS)


def load(
    name: str,
    batch: int,
    variant: str = "plain",
    camera: str = "hand",
    friction: float = 1.0,
    perturbation: Perturbation = NOMINAL,
    objects: str = ONE,
) -> Tabletop:
    """A batch of episodes of a task.

    Args:
        name: One of `names()`.
        batch: Number of episodes side by side.
        variant: Of the scene.
        camera: Which one takes the pictures.
        friction: Factor on all friction; 0 shows that grasps hold by friction alone.
        perturbation: What varies in the pictures.
        objects: Which objects the episodes have.

    Raises:
        ValueError: There is no such task, no such variant of it or no such objects, or a number
            makes no sense.
    """
    check(name, variant, objects)
    ranges.check("batch", batch, ranges.Count)
    ranges.check("friction", friction, ranges.NotNegative)
    return TASKS[name].make(
        batch,
        variant=variant,
        camera=camera,
        friction=friction,
        perturbation=perturbation,
        objects=objects,
    )


def check(name: str, variant: str = "plain", objects: str = ONE) -> str:
    """The name that demonstrations and weights have of a task's variant.

    Raises:
        ValueError: There is no such task, no such variant of it or no such objects.
    """
    if name not in TASKS:
        raise ValueError(f"task {name!r}: there is {', '.join(names())}")
    if variant not in TASKS[name].variants:
        known = " or ".join(TASKS[name].variants)
        raise ValueError(f"variant {variant!r} of {name}: {known}")
    if objects not in TASKS[name].objects:
        known = " or ".join(TASKS[name].objects)
        raise ValueError(f"objects {objects!r} of {name}: {known}")
    return full_name(name, variant)

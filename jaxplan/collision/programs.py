"""Compiled functions of scenes, which are forgotten with their scenes."""

from collections.abc import Callable
from functools import wraps
from typing import Any
from weakref import ReferenceType, WeakKeyDictionary, ref

import jax

from jaxplan.collision.engine import XLA_OPTIONS
from jaxplan.scene import Scene, Structure


def per_scene(function: Callable, **options: Any) -> Callable[..., Any]:
    """As `jax.jit(function)`, for a function of a scene and more.

    `jax.jit` would keep each scene that it was called with, and its programs, as long as the
    function itself: for ever. A program takes hundreds of memory maps, and a process may have
    no more than 65,530 on Linux.

    Args:
        function: Its first argument is a `Scene`.
        options: For `jax.jit`.
    """
    programs: WeakKeyDictionary[Structure, Callable] = WeakKeyDictionary()

    @wraps(function)
    def call(scene: Scene, *more: Any, **named: Any) -> Any:
        structure = scene.structure
        if structure not in programs:
            programs[structure] = _program(function, ref(structure), options)
        return programs[structure](scene.model, *more, **named)

    return call


def _program(
    function: Callable, structure: ReferenceType[Structure], options: dict[str, Any]
) -> Callable:
    """Of the scenes with one structure, to which no program may hold on."""

    @wraps(function)  # arguments keep their names
    def of_model(model: Any, *more: Any, **named: Any) -> Any:
        alive = structure()
        assert alive is not None
        return function(Scene(model, alive), *more, **named)

    return jax.jit(of_model, compiler_options=XLA_OPTIONS, **options)

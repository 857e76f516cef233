"""The settings of a training: a config file's, with the command line's on top."""

import argparse
import dataclasses
import difflib
import runpy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tyro


class UsageError(ValueError):
    """The command line or the config file is wrong."""


def parse(arguments: list[str], kinds: Mapping[str, Any]) -> tuple[str, Any]:
    """What to train, and the config file's settings with the command line's on top.

    Args:
        arguments: `KIND [--config FILE] [--setting VALUE ...]`.
        kinds: What can be trained, and its settings by default.

    Raises:
        UsageError: In one line.
    """
    first = argparse.ArgumentParser(prog="jaxplan.train", add_help=False)
    first.add_argument("kind", nargs="?")
    first.add_argument("--config")
    chosen, rest = first.parse_known_args(arguments)
    if chosen.kind not in kinds:
        raise UsageError(f"train what? {', '.join(kinds)} (got {chosen.kind!r})")
    default = kinds[chosen.kind]
    settings = type(default)
    if chosen.config is not None:
        default = _read_config(chosen.config, chosen.kind, settings)
    config, unknown = tyro.cli(
        settings,
        prog=f"python -m jaxplan.train {chosen.kind} [--config FILE]",
        description="FILE is a Python program, which is run: take only what you trust.",
        default=default,
        args=rest,
        return_unknown_args=True,
        # `encoder: EncoderConfig | None` keeps the kind that the config file gives it.
        config=(tyro.conf.AvoidSubcommands,),
    )
    if unknown:
        flags = _flags(default)
        near = difflib.get_close_matches(unknown[0].split("=")[0], flags, 1, 0.5)
        hint = f"; did you mean {near[0]}?" if near else "; see --help"
        raise UsageError(f"unknown setting {unknown[0]}{hint}")
    return chosen.kind, config


def _read_config(path: str, kind: str, settings: type) -> Any:
    """The variable named `kind` of a config file."""
    if not Path(path).is_file():
        near = difflib.get_close_matches(
            Path(path).stem, [p.stem for p in Path(path).parent.glob("*.py")], 1
        )
        hint = f"; did you mean {Path(path).with_name(near[0])}.py?" if near else ""
        raise UsageError(f"no such config: {path}{hint}")
    try:
        config: Any = runpy.run_path(path).get(kind)
    except Exception as error:  # a config is a program, and may fail in any way
        said = (str(error) or "no reason given").splitlines()[0]
        raise UsageError(f"{path}: {type(error).__name__}: {said}") from None
    if not isinstance(config, settings):
        raise UsageError(f"{path} defines no `{kind} = {settings.__name__}(...)`")
    return config


def _flags(config: Any, prefix: str = "--") -> list[str]:
    flags = []
    for field in dataclasses.fields(config):
        name = f"{prefix}{field.name.replace('_', '-')}"
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            flags += _flags(value, f"{name}.")
        flags.append(name)
    return flags

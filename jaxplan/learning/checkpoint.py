"""Checkpoints on disk: orbax, with a manifest of checksums beside each.

Orbax restores a file with a flipped bit without noticing; the manifest notices. It is
written last, so a checkpoint that a kill cut short has none and does not count.
"""

import json
import shutil
import warnings
from pathlib import Path
from typing import Any

import jax
from orbax.checkpoint import v1 as ocp

from jaxplan.data import sha256, write_atomic

KEPT = 2


class CheckpointError(ValueError):
    """A checkpoint is damaged or does not fit the run."""


def save(directory: Path, step: int, state: Any) -> None:
    """Saves `state` as `directory/<step>` and drops all but the newest `KEPT`."""
    target = directory.resolve() / str(step)
    directory.mkdir(parents=True, exist_ok=True)
    shutil.rmtree(target, ignore_errors=True)
    ocp.save(str(target), state)
    text = json.dumps(_checksums(target), indent=1, sort_keys=True)
    write_atomic(_manifest(directory, step), text.encode())
    for old in _steps(directory)[:-KEPT]:
        _manifest(directory, old).unlink()
        shutil.rmtree(directory / str(old), ignore_errors=True)


def latest(directory: Path) -> int | None:
    """The newest complete checkpoint's step, or None."""
    steps = _steps(directory)
    return steps[-1] if steps else None


def restore(directory: Path, step: int, like: Any) -> Any:
    """Loads checkpoint `step` into the structure of `like`, checksums verified.

    Raises:
        CheckpointError: A file is missing or altered, or the structure differs.
    """
    path = directory.resolve() / str(step)
    try:
        expected = json.loads(_manifest(directory, step).read_text())
    except (OSError, ValueError):
        raise CheckpointError(f"damaged checkpoint: {path} (no manifest)") from None
    found = _checksums(path)
    for name in sorted(set(expected) | set(found)):
        if expected.get(name) != found.get(name):
            raise CheckpointError(
                f"damaged checkpoint: {path} ({name}); delete it to go on from an older one"
            )
    abstract = jax.tree.map(
        lambda x: jax.ShapeDtypeStruct(x.shape, x.dtype, sharding=x.sharding), like
    )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ocp.load(str(path), abstract)
    except Exception as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise CheckpointError(f"{path} does not fit this run ({reason})") from None


def _manifest(directory: Path, step: int) -> Path:
    return directory / f"{step}.sha256.json"


def _steps(directory: Path) -> list[int]:
    names = [path.name.split(".")[0] for path in directory.glob("*.sha256.json")]
    return sorted(int(n) for n in names if n.isdigit() and (directory / n).is_dir())


def _checksums(path: Path) -> dict[str, str]:
    files = (file for file in path.rglob("*") if file.is_file())
    return {str(file.relative_to(path)): sha256(file) for file in files}

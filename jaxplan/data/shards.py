"""Demonstrations on disk: `shard_00000.npz` ..., and a manifest of their checksums.

A shard appears whole or not at all (written beside, then renamed) and its bytes depend
on its arrays only, so a collection that was killed and resumed equals one that was not.
"""

import json
import os
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from jaxplan.data.files import intact, sealed, sha256, write_atomic, write_npz
from jaxplan.data.schema import (
    KINDS,
    DataError,
    Demonstrations,
    PathShard,
    Shard,
    TimedShard,
    check_shard,
    concatenate,
)

MANIFEST = "manifest.json"


def shard_path(directory: str | os.PathLike, index: int) -> Path:
    """`directory/shard_00012.npz` for index 12."""
    return Path(directory) / f"shard_{index:05d}.npz"


def write_shard(path: str | os.PathLike, shard: Demonstrations | PathShard) -> None:
    """Writes a checked shard; the same arrays give the same bytes."""
    write_npz(path, check_shard(shard)._asdict())


def read_shard(path: str | os.PathLike) -> Any:
    """Reads and checks a shard, of the kind that it is.

    Raises:
        DataError: The file is missing, truncated, altered, or not a shard.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
        kind = next(kind for kind in KINDS if {*kind._fields} == {*found})
        return check_shard(kind(**found))
    except FileNotFoundError:
        raise DataError(f"missing shard: {path}") from None
    except Exception as error:  # a broken archive raises nearly anything
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise DataError(f"damaged shard: {path} ({reason})") from None


def read_demonstrations(directory: str | os.PathLike, kind: type = Shard) -> Any:
    """All shards of a finished collection, verified against its manifest.

    Raises:
        DataError: No such directory, no manifest, a shard is missing or damaged, or these are
            demonstrations of another kind.
    """
    paths = [Path(directory) / name for name in verify(directory)["shards"]]
    with ThreadPoolExecutor() as pool:
        shards = list(pool.map(read_shard, paths))
    if any(type(shard) is not kind for shard in shards):
        raise DataError(f"{directory} has no {_NEEDED[kind]}")
    return concatenate(shards)


_NEEDED = {
    Shard: "frames with subgoals: collect them without --timed",
    TimedShard: "timed demonstrations: collect them with --timed",
    PathShard: "paths of a scene: record them with `jaxplan record`",
}


def write_manifest(directory: str | os.PathLike, settings: Mapping) -> dict:
    """Records the generating settings and the SHA-256 of every shard that is there.

    Call it once before collecting (it fixes the settings) and once after.
    """
    shards = sorted(Path(directory).glob("shard_*.npz"))
    return save_manifest(
        directory, settings, {path.name: sha256(path) for path in shards}
    )


def save_manifest(
    directory: str | os.PathLike, settings: Mapping, shards: Mapping[str, str]
) -> dict:
    """Writes `{"settings": ..., "shards": {name: SHA-256}}` and its seal, which it returns."""
    manifest = sealed({"settings": dict(settings), "shards": dict(shards)})
    text = json.dumps(manifest, indent=2, sort_keys=True) + "\n"
    write_atomic(Path(directory) / MANIFEST, text.encode())
    return manifest


def read_manifest(directory: str | os.PathLike) -> dict:
    """The manifest of `directory`, or DataError."""
    directory = Path(directory)
    if not directory.is_dir():
        raise DataError(f"no such data directory: {directory}")
    try:
        manifest = json.loads((directory / MANIFEST).read_text())
        if not intact(manifest):
            raise ValueError("changed")
        return manifest
    except FileNotFoundError:
        raise DataError(f"no {MANIFEST} in {directory}: unfinished?") from None
    except (ValueError, AttributeError):
        raise DataError(f"damaged manifest: {directory / MANIFEST}") from None


def verify(directory: str | os.PathLike, names: Collection[str] | None = None) -> dict:
    """Checks shards' SHA-256 against the manifest, which it returns.

    Args:
        directory: Of the shards.
        names: Which; None = all that are listed.

    Raises:
        DataError: Names the first shard that is missing or differs; or none is listed.
    """
    manifest = read_manifest(directory)
    if not manifest["shards"]:
        raise DataError(
            f"no shards listed in {Path(directory) / MANIFEST}: unfinished?"
        )
    for name in manifest["shards"] if names is None else names:
        path, digest = Path(directory) / name, manifest["shards"].get(name)
        if digest is None or not path.is_file():
            raise DataError(f"missing shard: {path}")
        if sha256(path) != digest:
            raise DataError(f"damaged shard: {path} (checksum differs from {MANIFEST})")
    return manifest


def missing_shards(
    directory: str | os.PathLike, count: int, settings: Mapping
) -> list[int]:
    """Which of shards 0..count-1 are still to be made (absent, or damaged).

    Raises:
        DataError: The directory was begun with other settings.
    """
    directory = Path(directory)
    listed: dict = {}
    if (directory / MANIFEST).exists():
        manifest = read_manifest(directory)
        listed = manifest["shards"]
        wanted = json.loads(json.dumps(dict(settings)))
        if manifest["settings"] != wanted:
            raise DataError(
                f"{directory} was made with settings {manifest['settings']}, "
                f"not {wanted}: choose another directory"
            )
    return [i for i in range(count) if not _is_whole(shard_path(directory, i), listed)]


def _is_whole(path: Path, listed: Mapping[str, str]) -> bool:
    if not path.is_file():
        return False
    if path.name in listed:
        return sha256(path) == listed[path.name]
    try:
        read_shard(path)
    except DataError:
        return False
    return True

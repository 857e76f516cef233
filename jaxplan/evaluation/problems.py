"""Planning problems that the outer loop posed, on disk: every method gets the same ones.

A problem is one phase of one episode: what the search is asked, in which world, and what
the learned samplers are conditioned on. Shards of whole episodes lie in a directory with
a manifest of checksums (`jaxplan.data`).
"""

import json
import os
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from jaxplan.collision import World
from jaxplan.data import DataError, sha256, write_atomic, write_npz

MANIFEST = "manifest.json"


class Problems(NamedTuple):
    """P phases, in the order of episodes and phases."""

    seed: np.ndarray
    """i32 [P] of the episode."""
    phase: np.ndarray
    """i32 [P] number of the round in its episode."""
    success: np.ndarray
    """bool [P]: the episode ended well, whoever drove it."""
    toggle: np.ndarray
    """i8 [P] index into `data.TOGGLES` of the toggle that comes next."""
    last: np.ndarray
    """bool [P]: the motion ends at that toggle."""
    blocked: np.ndarray
    """bool [P]: the straight motion from `q_start` to `q_goal` is not free."""
    q_start: np.ndarray
    """f32 [P, 7] [rad]."""
    q_goal: np.ndarray
    """f32 [P, 7] [rad]."""
    q_toggle: np.ndarray
    """f32 [P, 7] [rad]."""
    gripper_toggle: np.ndarray
    """u8 [P]."""
    image: np.ndarray
    """u8 [P, 88, 136, 3]: what was observed, with the next two."""
    q: np.ndarray
    """f32 [P, 7] [rad]: `q_start` but where that was moved out of a collision."""
    gripper: np.ndarray
    """u8 [P]."""
    target: np.ndarray
    """f32 [P, 7] [rad]: the subgoal as predicted; `q_goal` but for collisions, likewise."""
    object_pose: np.ndarray
    """The rest is the `World` of each problem."""
    held: np.ndarray
    passive: np.ndarray
    ignored: np.ndarray
    slot_pose: np.ndarray
    slot_size: np.ndarray

    @property
    def worlds(self) -> World:
        """Leaves [P, ...]."""
        return World(*(getattr(self, name) for name in World._fields))

    @property
    def episode(self) -> np.ndarray:
        """i64 [P] which episode (trial) each problem belongs to, counted from 0."""
        return np.unique(self.seed, return_inverse=True)[1]

    def take(self, rows: np.ndarray) -> "Problems":
        """Some of the problems."""
        return Problems(*(column[rows] for column in self))

    def keys(self) -> jax.Array:
        """[P] typed keys, as the outer loop gives them to search and sampler."""
        return jax.vmap(
            lambda seed, phase: jax.random.fold_in(jax.random.key(seed), phase)
        )(self.seed.astype(np.uint32), self.phase)


def read_manifest(directory: str | os.PathLike) -> dict | None:
    """`{"settings": ..., "shards": {name: SHA-256}}`, or None where nothing was begun.

    Raises:
        DataError: It is damaged.
    """
    path = Path(directory) / MANIFEST
    if not path.exists():
        return None
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        if not {"settings", "shards"} <= set(manifest):
            raise KeyError("shards")
    except (ValueError, KeyError, TypeError):
        raise DataError(f"damaged manifest: {path}") from None
    return manifest


def begin(directory: str | os.PathLike, settings: dict) -> dict[str, str]:
    """Begins a directory or goes on with it; returns the shards that are there and intact.

    Raises:
        DataError: It was begun with other settings.
    """
    manifest = read_manifest(directory)
    if manifest is None:
        _write_manifest(directory, settings, {})
        return {}
    if manifest["settings"] != settings:
        raise DataError(
            f"{directory} was recorded with {manifest['settings']}, not {settings}"
        )
    return {
        name: digest
        for name, digest in manifest["shards"].items()
        if (path := Path(directory) / name).is_file() and sha256(path) == digest
    }


def add(directory: str | os.PathLike, name: str, problems: Problems) -> None:
    """Writes a shard, and its checksum into the manifest."""
    write_npz(Path(directory) / name, problems._asdict())
    manifest = read_manifest(directory)
    assert manifest is not None, "`begin` comes first"
    digest = sha256(Path(directory) / name)
    shards = manifest["shards"] | {name: digest}
    _write_manifest(directory, manifest["settings"], shards)


def read(directory: str | os.PathLike, names: list[str]) -> Problems:
    """The problems of some shards, checksums verified.

    Raises:
        DataError: Names the shard that is missing or damaged.
    """
    shards = (read_manifest(directory) or {"shards": {}})["shards"]
    parts = []
    for name in names:
        path = Path(directory) / name
        if name not in shards or not path.is_file():
            raise DataError(f"missing shard: {path}")
        if sha256(path) != shards[name]:
            raise DataError(f"damaged shard: {path} (checksum differs from {MANIFEST})")
        with np.load(path, allow_pickle=False) as archive:
            parts.append([archive[field] for field in Problems._fields])
    return Problems(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _write_manifest(
    directory: str | os.PathLike, settings: dict, shards: dict[str, str]
) -> None:
    manifest = {"settings": settings, "shards": shards}
    text = json.dumps(manifest, indent=2, sort_keys=True) + "\n"
    write_atomic(Path(directory) / MANIFEST, text.encode())

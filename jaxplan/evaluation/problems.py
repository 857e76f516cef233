"""Planning problems that the outer loop posed, on disk: every method gets the same ones.

A problem is one phase of one episode: what the search is asked, in which world, and what
the learned samplers are conditioned on. Shards of whole episodes lie in a directory with
a manifest of checksums (`jaxplan.data`).
"""

import os
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np

from jaxplan.collision import World
from jaxplan.collision.obstacles import FAR
from jaxplan.data import (
    MANIFEST,
    TOGGLES,
    DataError,
    read_manifest,
    save_manifest,
    sha256,
    verify,
    write_npz,
)
from jaxplan.episodes import phase_keys


class RecordedProblems(NamedTuple):
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
    """f32 [P, d] [rad]."""
    q_goal: np.ndarray
    """f32 [P, d] [rad]."""
    q_toggle: np.ndarray
    """f32 [P, d] [rad]."""
    gripper_toggle: np.ndarray
    """u8 [P]."""
    image: np.ndarray
    """u8 [P, 88, 136, 3]: what was observed, with the next two."""
    q: np.ndarray
    """f32 [P, d] [rad]: `q_start` but where that was moved out of a collision."""
    gripper: np.ndarray
    """u8 [P]."""
    target: np.ndarray
    """f32 [P, d] [rad]: the subgoal as predicted; `q_goal` but for collisions, likewise."""
    object_pose: np.ndarray
    """The rest is the `World` of each problem."""
    held: np.ndarray
    passive: np.ndarray
    ignored: np.ndarray
    slot_pose: np.ndarray
    slot_size: np.ndarray
    geom_pos: np.ndarray
    geom_size: np.ndarray

    @property
    def worlds(self) -> World:
        """Leaves [P, ...]."""
        return World(*(getattr(self, name) for name in World._fields))

    @property
    def episode(self) -> np.ndarray:
        """i64 [P] which episode (trial) each problem belongs to, counted from 0."""
        return np.unique(self.seed, return_inverse=True)[1]

    @property
    def past_the_obstacle(self) -> np.ndarray:
        """bool [P]: the way to the last toggle is blocked, where it may have several ways."""
        return self.blocked & (self.toggle == len(TOGGLES) - 1)

    @property
    def closed(self) -> np.ndarray:
        """bool [P]: the episode closes a way, its zone stands in a slot."""
        return np.asarray((self.slot_pose[:, :, 2] < FAR[2]).any(axis=1))

    def take(self, rows: np.ndarray) -> "RecordedProblems":
        """Some of the problems."""
        return RecordedProblems(*(column[rows] for column in self))

    def keys(self) -> jax.Array:
        """[P] typed keys, as the outer loop gives them to search and sampler."""
        return phase_keys(self.seed, self.phase)


def begin(directory: str | os.PathLike, settings: dict) -> dict[str, str]:
    """Begins a directory or goes on with it; returns the shards that are there and intact.

    Raises:
        DataError: It was begun with other settings, or its manifest is damaged.
    """
    directory = Path(directory)
    if not (directory / MANIFEST).exists():
        save_manifest(directory, settings, {})
        return {}
    manifest = read_manifest(directory)
    if manifest["settings"] != settings:
        raise DataError(
            f"{directory} was recorded with {manifest['settings']}, not {settings}"
        )
    return {
        name: digest
        for name, digest in manifest["shards"].items()
        if (path := directory / name).is_file() and sha256(path) == digest
    }


def add(directory: str | os.PathLike, name: str, problems: RecordedProblems) -> None:
    """Writes a shard, and its checksum into the manifest."""
    path = Path(directory) / name
    write_npz(path, problems._asdict())
    manifest = read_manifest(directory)
    shards = manifest["shards"] | {name: sha256(path)}
    save_manifest(directory, manifest["settings"], shards)


def read(directory: str | os.PathLike, names: list[str]) -> RecordedProblems:
    """The problems of some shards, checksums verified.

    Raises:
        DataError: Names the shard that is missing or damaged.
    """
    verify(directory, names)
    parts = []
    for name in names:
        with np.load(Path(directory) / name, allow_pickle=False) as archive:
            parts.append([archive[field] for field in RecordedProblems._fields])
    return RecordedProblems(
        *(np.concatenate(column) for column in zip(*parts, strict=True))
    )

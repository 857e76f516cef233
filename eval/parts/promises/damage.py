"""R10, R11, R13: files that changed on disk, or were made to do harm."""

import json
import os
import pickle
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxplan import data, pretrained
from jaxplan.data import IMAGE_SHAPE, PATH_POINTS, DataError
from jaxplan.evaluation.memo import Memo
from jaxplan.learning import CheckpointError, WeightsError, checkpoint
from parts.promises.promise import Promise, Trial

NOTICED = (DataError, WeightsError, CheckpointError)
"""What a reader says of a file that it does not trust."""


class Store(NamedTuple):
    """Something that is kept in files."""

    name: str
    make: Callable[[Path], None]
    read: Callable[[Path], Any]
    """Its content, or one of `NOTICED`."""


def _shard(directory: Path) -> None:
    rng, frames = np.random.default_rng(0), 6
    for index in range(2):
        shard = data.as_shard(
            image=rng.integers(0, 256, (frames, *IMAGE_SHAPE)),
            q=rng.normal(size=(frames, 7)),
            gripper=np.arange(frames) % 2,
            q_toggle=rng.normal(size=(frames, 7)),
            gripper_toggle=np.arange(frames) % 2,
            q_goal=rng.normal(size=(frames, 7)),
            toggle=np.arange(frames) % 4,
            seed=np.full(frames, index),
            camera_error=np.zeros((frames, 5)),
            path=np.arange(frames),
            arc=np.zeros(frames),
            path_q=rng.normal(size=(frames, PATH_POINTS, 7)),
            path_length=np.ones(frames),
            episode_seed=[index],
            episode_success=[True],
            episode_failure=[""],
        )
        data.write_shard(data.shard_path(directory, index), shard)
    data.write_manifest(directory, {"seeds": 2})


def _weights(directory: Path) -> None:
    for name in (pretrained.UPPER, "gan"):
        weights = pretrained.load_weights(name)
        info = {k: v for k, v in weights.info.items() if k not in ("file", "sha256")}
        pretrained.save_weights(directory, name, weights.params, weights.config, info)


def _state() -> dict[str, jax.Array]:
    return {"w": jnp.arange(4096.0), "step": jnp.array(3)}


def _checkpoints(directory: Path) -> None:
    for step in (2, 3):
        checkpoint.save(directory, step, _state())


def _restore(directory: Path) -> Any:
    step = checkpoint.latest(directory)
    if step is None:
        raise CheckpointError("none")
    return checkpoint.restore(directory, step, _state())


def _remember(directory: Path) -> Any:
    return Memo(directory)({"a": 1}, lambda: list(range(200)))


STORES = (
    Store(
        "demonstrations",
        _shard,
        lambda d: (data.read_demonstrations(d), data.read_manifest(d)),
    ),
    Store(
        "weights",
        _weights,
        lambda d: [pretrained.load_weights(n, d)[:2] for n in ("predictor", "gan")],
    ),
    Store("checkpoint", _checkpoints, _restore),
    Store("pieces of a measurement", lambda d: _remember(d) and None, _remember),
)


def _whole(place: Path) -> dict[str, tuple[Store, Path, Any]]:
    found = {}
    for store in STORES:
        directory = place / store.name.replace(" ", "_")
        directory.mkdir()
        store.make(directory)
        found[store.name] = store, directory, store.read(directory)
    return found


def _damaged(place: Path, change: Callable[[np.random.Generator, Path], str]) -> Trial:
    """A change to a file of a store, drawn by its number, then undone."""
    stores = _whole(place)
    names = list(stores)

    def one(number: int) -> str | None:
        rng = np.random.default_rng(number)
        store, directory, expected = stores[names[number % len(names)]]
        files = sorted(p for p in directory.rglob("*") if p.is_file())
        sizes = np.array([path.stat().st_size for path in files], float)
        # Each file as likely by its bytes as by its being there: small ones rule others.
        share = (sizes / sizes.sum() + 1 / len(files)) / 2
        path = files[rng.choice(len(files), p=share)]
        before = path.read_bytes()
        said = change(rng, path)
        try:
            found = store.read(directory)
            same = jax.tree.all(jax.tree.map(np.array_equal, found, expected))
            return None if same else f"{store.name}: {path.name} {said}: not noticed"
        except NOTICED:
            return None
        except Exception as error:
            kind = type(error).__name__
            return f"{store.name}: {path.name} {said}: {kind}: {error}"
        finally:
            for other in {p for p in directory.rglob("*") if p.is_file()} - {*files}:
                other.unlink()
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(before)

    return lambda numbers: [fault for n in numbers if (fault := one(n))]


def _flip(rng: np.random.Generator, path: Path) -> str:
    content = bytearray(path.read_bytes())
    if not content:
        return "is empty"
    at, bit = int(rng.integers(len(content))), int(rng.integers(8))
    content[at] ^= 1 << bit
    path.write_bytes(content)
    return f"bit {bit} of byte {at}"


def _cut(rng: np.random.Generator, path: Path) -> str:
    if rng.random() < 0.3:
        path.unlink()
        return "missing"
    size = int(rng.integers(path.stat().st_size + 1))
    path.write_bytes(path.read_bytes()[:size])
    return f"cut to {size} bytes"


class _Harm:
    """What runs a command when it is unpickled."""

    def __init__(self, marker: Path) -> None:
        self._marker = marker

    def __reduce__(self) -> tuple:
        return os.mkdir, (str(self._marker),)


def _objects(path: Path, marker: Path) -> None:
    """An archive whose arrays are pickles."""
    harm = np.array([_Harm(marker)], dtype=object)
    with np.load(path, allow_pickle=False) as archive:
        names = archive.files
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, harm, allow_pickle=True)


def _pickled(path: Path, marker: Path) -> None:
    path.write_bytes(pickle.dumps(_Harm(marker)))


def _outside(path: Path, marker: Path) -> None:
    """A manifest that names a file in another directory."""
    manifest = path.parent / "manifest.json"
    if manifest.exists():
        text = manifest.read_text().replace(path.name, f"../{path.name}")
        manifest.write_text(text)
        _objects(path, marker)
        shutil.move(path, path.parent.parent / path.name)


def _malicious(place: Path) -> Trial:
    stores = _whole(place)
    cases = [(name, harm) for name in stores for harm in (_objects, _pickled, _outside)]

    def one(number: int) -> str | None:
        name, harm = cases[number % len(cases)]
        store, directory, _ = stores[name]
        copy = place / f"copy_{number}" / "inside"
        shutil.copytree(directory, copy)
        marker = place / f"ran_{number}"
        for path in sorted(p for p in copy.rglob("*") if p.is_file()):
            if path.suffix == ".npz" or (harm is _pickled and path.suffix != ".json"):
                harm(path, marker)
        _trust(copy)
        try:
            store.read(copy)
        except NOTICED:
            pass
        except Exception as error:
            return f"{name}, {number}: {type(error).__name__}: {error}"
        return f"{name}, {number}: code was run" if marker.exists() else None

    return lambda numbers: [fault for n in numbers if (fault := one(n))]


def _trust(directory: Path) -> None:
    """Checksums that fit: whoever made the file made its manifest too."""
    files = {path.name: path for path in directory.parent.rglob("*") if path.is_file()}
    for manifest in directory.rglob("*.json"):
        content = _with_checksums(json.loads(manifest.read_text()), files)
        manifest.write_text(json.dumps(content))


def _with_checksums(node: Any, files: dict[str, Path]) -> Any:
    """Those of the files as they are now."""
    if not isinstance(node, dict):
        return node
    node = {
        key: data.sha256(files[Path(key).name])
        if Path(key).name in files and isinstance(value, str)
        else _with_checksums(value, files)
        for key, value in node.items()
    }
    if "file" in node:
        node["sha256"] = data.sha256(files[Path(node["file"]).name])
    return data.sealed(node) if data.SEAL in node else node


PROMISES = (
    Promise(
        "R10",
        "one flipped bit in demonstrations, weights, checkpoints or kept pieces, unnoticed",
        1000,
        100,
        lambda place: _damaged(place, _flip),
        "orbax alone: 13 of 24 restored silently wrong",
    ),
    Promise(
        "R11",
        "one of their files cut or missing, unnoticed, or a traceback",
        200,
        50,
        lambda place: _damaged(place, _cut),
    ),
    Promise(
        "R13",
        "code run by reading archives of pickles, with checksums that fit",
        12,
        12,
        _malicious,
        "torch.load of dill in three peers: runs",
    ),
)

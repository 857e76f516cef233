"""Weights as shipped: npz files without pickle, and a manifest that ties them down.

`manifest.json` holds, for each network, the file's SHA-256, the network's config, the data
set's checksum, the commit, the versions and the held-out metrics, and a checksum of all that.
"""

import dataclasses
import json
import os
import subprocess
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import jax
import numpy as np

from jaxplan import policies
from jaxplan.config import from_dict
from jaxplan.data import (
    IMAGE_SHAPE,
    intact,
    sealed,
    sha256,
    write_atomic,
    write_npz,
)
from jaxplan.learning.weights import NoWeights, Weights, WeightsError
from jaxplan.networks import PolicyConfig, Predictor, PredictorConfig
from jaxplan.policies import POLICIES
from jaxplan.samplers import FAMILIES, init

DIRECTORY = Path(__file__).parent
"""The weights that the package ships, those of other scenes in directories inside."""
UPPER = "predictor"
"""The upper network's name; the others are sampler families and policies."""
MANIFEST = "manifest.json"


def shipped(variant: str = "plain") -> Path:
    """The directory of a scene's weights."""
    return DIRECTORY if variant == "plain" else DIRECTORY / variant


def config_class(name: str) -> type:
    """The settings of a network's weights, by the network's name."""
    return PredictorConfig if name == UPPER else (FAMILIES | POLICIES)[name].config


def save_weights(
    directory: str | os.PathLike, name: str, params: dict, config: Any, info: dict
) -> Path:
    """Writes `name.npz` and its entry in the manifest; other entries stay.

    Args:
        directory: Where; made if it does not exist.
        name: `predictor`, or of a sampler family or a policy.
        params: Nested dict of arrays. What only training needs is left out.
        config: The network's config.
        info: What else the manifest should say; must be JSON.
    """
    path = Path(directory) / f"{name}.npz"
    flat = _flatten(jax.device_get(params))
    write_npz(path, {key: _shortened(flat[key]) for key in _shapes(config, flat)})
    manifest = _read_manifest(directory) if (path.parent / MANIFEST).exists() else {}
    manifest[name] = sealed(
        {
            "file": path.name,
            "sha256": sha256(path),
            "config": dataclasses.asdict(config),
            "commit": _commit(),
            "versions": {p: version(p) for p in ("jax", "flax", "optax", "numpy")},
            **info,
        }
    )
    text = json.dumps(manifest, indent=2, sort_keys=True) + "\n"
    write_atomic(path.parent / MANIFEST, text.encode())
    return path


def networks_in(directory: str | os.PathLike) -> list[str]:
    """Names of the networks whose weights a directory has.

    Raises:
        WeightsError: It has no manifest, or a damaged one.
    """
    return list(_read_manifest(directory))


def load_weights(name: str, directory: str | os.PathLike = DIRECTORY) -> Weights:
    """Reads a network's weights, checksum and shapes verified.

    Raises:
        WeightsError: Missing (`NoWeights`) or damaged, in one line.
    """
    manifest = _read_manifest(directory)
    if name not in manifest:
        raise NoWeights(
            f"no {name} in {Path(directory) / MANIFEST} (there: {', '.join(manifest)})"
        )
    info = manifest[name]
    try:
        if not intact(info):
            raise ValueError("its checksum differs")
        path = Path(directory) / Path(info["file"]).name
        digest = info["sha256"]
        config = from_dict(config_class(name), info["config"])
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        where = Path(directory) / MANIFEST
        raise WeightsError(f"damaged manifest: {where} ({name}: {error})") from None
    if not path.is_file():
        raise WeightsError(f"missing weights: {path}")
    if sha256(path) != digest:
        raise WeightsError(
            f"damaged weights: {path} (checksum differs from {MANIFEST})"
        )
    try:
        with np.load(path, allow_pickle=False) as archive:
            flat = {key: archive[key] for key in archive.files}
    except (ValueError, BadZipFile) as error:
        raise WeightsError(f"damaged weights: {path} ({error})") from None
    _check_shapes(path, flat, _shapes(config, flat))
    return Weights(config, _unflatten(flat), info)


def load_pair(
    directory: str | os.PathLike = DIRECTORY, name: str = "sampler"
) -> tuple[Weights, Weights]:
    """The predictor, and a sampler that was trained on its features.

    Args:
        directory: Where the weights and their manifest are.
        name: Of the sampler.

    Raises:
        WeightsError: As `load_weights`, or the sampler belongs to another predictor.
    """
    predictor = load_weights(UPPER, directory)
    sampler = load_weights(name, directory)
    wanted = sampler.info.get("predictor_sha256")
    if wanted not in (None, predictor.info["sha256"]):
        raise WeightsError(
            f"the {name} in {directory} was trained on another predictor's features"
        )
    return predictor, sampler


def _shapes(config: Any, flat: dict[str, np.ndarray]) -> dict[str, tuple[int, ...]]:
    """What weights of this config consist of, to draw or predict with."""
    norms = [key for key in flat if key.endswith("condition/image_norm/scale")]

    def fresh(key: jax.Array) -> dict:
        if isinstance(config, PredictorConfig):
            q = np.zeros((1, len(config.q_min)), np.float32)
            image = np.zeros((1, *IMAGE_SHAPE), np.uint8)
            return Predictor(config).init(key, image, q, q[:, 0])  # pyright: ignore
        if isinstance(config, PolicyConfig):
            return policies.init(config, key)
        own = not norms or config.encoder is not None
        return init(config, key, IMAGE_SHAPE if own else flat[norms[0]].shape, False)

    params = jax.eval_shape(fresh, jax.random.key(0))
    return {key: value.shape for key, value in _leaves(params)}


def _check_shapes(
    path: Path, flat: dict[str, np.ndarray], wanted: dict[str, tuple[int, ...]]
) -> None:
    """Refuses weights that are not those of the config beside them."""
    for key in sorted(flat | wanted):
        found = flat[key].shape if key in flat else "missing"
        if found != wanted.get(key, "unknown"):
            raise WeightsError(
                f"weights of another network: {path} ({key} is {found}, "
                f"its config expects {wanted.get(key, 'none')})"
            )


def _read_manifest(directory: str | os.PathLike) -> dict:
    path = Path(directory) / MANIFEST
    try:
        manifest = json.loads(path.read_text())
    except OSError:
        raise WeightsError(f"missing weights: no {path}") from None
    except ValueError:
        raise WeightsError(f"damaged manifest: {path}") from None
    if not isinstance(manifest, dict):
        raise WeightsError(f"damaged manifest: {path}")
    return manifest


def _flatten(params: dict) -> dict[str, np.ndarray]:
    return {key: np.asarray(value) for key, value in _leaves(params)}


def _leaves(params: dict, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Names with slashes, sorted, and what they stand for."""
    for key, value in sorted(params.items()):
        if isinstance(value, dict):
            yield from _leaves(value, f"{prefix}{key}/")
        else:
            yield f"{prefix}{key}", value


def _unflatten(flat: dict[str, np.ndarray]) -> dict:
    params: dict = {}
    for name, value in flat.items():
        *parents, leaf = name.split("/")
        node = params
        for parent in parents:
            node = node.setdefault(parent, {})
        node[leaf] = value
    return params


def _shortened(x: np.ndarray) -> np.ndarray:
    """To 16 bits of mantissa (1e-5 relative): compressed, weights take a quarter less."""
    if x.dtype != np.float32:
        return x
    bits = np.ascontiguousarray(x).view(np.uint32)
    return ((bits + 0x40) & np.uint32(0xFFFFFF80)).view(np.float32)


def _commit() -> str | None:
    """The commit of the working tree that trained; None where no repository has this file."""
    here = Path(__file__)

    def git(*command: str) -> str:
        asked = ["git", "-C", str(here.parent), *command]
        return subprocess.run(
            asked, capture_output=True, text=True, check=True
        ).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", here.name)
        # Weights that were trained just before may wait to be committed: code counts alone.
        changed = git("status", "--porcelain", "--untracked-files=no", "--", ":/*.py")
        return git("rev-parse", "HEAD") + ("-dirty" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return None

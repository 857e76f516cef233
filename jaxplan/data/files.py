"""Files that are whole or absent, and whose bytes depend on their content only."""

import hashlib
import io
import json
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

SEAL = "seal"
"""In JSON files, their own checksum."""


def sha256(path: str | os.PathLike) -> str:
    """Hex SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """What JSON will give back of some content, with a checksum of all of it."""
    plain = {name: value for name, value in content.items() if name != SEAL}
    text = json.dumps(plain, sort_keys=True)
    digest = hashlib.sha256(text.encode()).hexdigest()
    return json.loads(text) | {SEAL: digest}


def intact(content: Mapping[str, Any]) -> bool:
    """Whether content that was sealed is as it was."""
    return content.get(SEAL) == sealed(content)[SEAL]


def write_atomic(path: str | os.PathLike, content: bytes) -> None:
    """Writes a file that a kill leaves either whole or as it was before."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    with open(beside, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


class UnwritableError(ValueError):
    """Nothing can be written where it is wanted."""


def check_writable(path: str | os.PathLike, directory: bool, name: str) -> None:
    """Finds out before hours of work whether something can be written.

    Args:
        path: Of a directory, or of a file; it need not be there yet.
        directory: Which of them.
        name: Of the setting, for the message.

    Raises:
        UnwritableError: It cannot.
    """
    path = Path(path)
    if path.is_dir() and not directory:
        raise UnwritableError(f"{name} {path}: is a directory")
    place = path if directory else path.parent
    while not place.exists():
        place = place.parent
    if not place.is_dir():
        raise UnwritableError(f"{name} {path}: {place} is a file")
    try:
        tempfile.TemporaryFile(dir=place).close()
    except OSError as error:
        said = f"{name} {path}: {place}: {error.strerror}"
        raise UnwritableError(said) from None


def write_npz(path: str | os.PathLike, arrays: Mapping[str, np.ndarray]) -> None:
    """Writes a compressed npz without pickle; the same arrays give the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array, allow_pickle=False)
            # A bare ZipInfo has a fixed date.
            archive.writestr(
                zipfile.ZipInfo(f"{name}.npy"),
                member.getbuffer(),
                compress_type=zipfile.ZIP_DEFLATED,
                compresslevel=1,
            )
    write_atomic(path, buffer.getvalue())

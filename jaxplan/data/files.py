"""Files that are whole or absent, and whose bytes depend on their content only."""

import hashlib
import io
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np


def sha256(path: str | os.PathLike) -> str:
    """Hex SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


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

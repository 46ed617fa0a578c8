"""The seal: a checksum of the whole file, behind its end.

HDF5's checksums cover chunks of numbers and some metadata; one wrong byte elsewhere can make the HDF5 library itself
crash (seen: a double free, which ends the process). So a file is judged before the library sees it. HDF5 and
everything built on it ignore what stands behind the end that the file states, so the seal is in nobody's way.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from iapb.errors import RunFileError

_MARK = b"\niapb sha256 "
_LENGTH = len(_MARK) + 64 + 1  # the mark, 64 hexadecimal digits, a newline
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_BLOCK = 1 << 20


def seal(path: Path) -> None:
    """Append the checksum of a file to it."""
    mark = _MARK + _checksum(path, path.stat().st_size).encode() + b"\n"
    with path.open("ab") as file:
        file.write(mark)


def check_seal(path: Path) -> None:
    """Raise RunFileError unless `path` is an HDF5 file that is, to the byte, as it was sealed."""
    with path.open("rb") as file:
        if file.read(len(_HDF5_SIGNATURE)) != _HDF5_SIGNATURE:
            raise RunFileError(f"{path}: not an HDF5 file, or damaged at its beginning")
    size = path.stat().st_size - _LENGTH
    with path.open("rb") as file:
        file.seek(max(size, 0))
        mark = file.read()
    if size < 0 or not mark.startswith(_MARK):
        raise RunFileError(f"{path}: no checksum at its end: the file was cut short, changed, or is not of iapb")
    if mark != _MARK + _checksum(path, size).encode() + b"\n":
        raise RunFileError(f"{path}: differs from its checksum, the file is damaged")


def _checksum(path: Path, size: int) -> str:
    """Return sha256 of the first `size` bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while size > 0 and (block := file.read(min(_BLOCK, size))):
            digest.update(block)
            size -= len(block)
    return digest.hexdigest()

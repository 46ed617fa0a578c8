"""Files that are not what they should be: a byte flipped, another format, another version, somebody else's."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from iapb.errors import RunFileError
from reports.faults.sample import inputs_of, numbered, open_store
from reports.store.io import seal
from reports.store.keys import content_hash
from reports.store.runs import read_run
from reports.store.schema import FORMAT_VERSION


def damaged_byte(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Flip a random bit of a random byte; reading must refuse, or give the results unchanged."""
    path, content = _stored(folder)
    right, rng = content_hash(read_run(path)), np.random.default_rng(2)
    survived, said = 0, ""
    for _ in range(times):
        damaged = bytearray(content)
        damaged[int(rng.integers(len(damaged)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(damaged))
        try:
            survived += content_hash(read_run(path)) == right
        except RunFileError as error:
            survived, said = survived + 1, _told(error, path)
    return times, survived, times - survived, said


def foreign_file(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Files that are no runs, of every kind in turn; each must be refused by name."""
    path, content = _stored(folder)
    kinds = list(_foreign(content))
    return _refused(path, [kinds[k % len(kinds)] for k in range(times)])


def _foreign(content: bytes) -> Iterator[Callable[[Path], None]]:
    """Nothing, a table, half of a run, its first bytes, a run with a tail, somebody else's HDF5."""
    for wrong in (b"", b"time,x\n0,1\n", content[: len(content) // 2], content[:8], content + b"tail"):
        yield partial(_put, wrong)
    yield _somebody_elses


def _put(content: bytes, path: Path) -> None:
    path.write_bytes(content)


def _somebody_elses(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["x"] = np.arange(3.0)
    seal(path)


def other_version(folder: Path, times: int) -> tuple[int, int, int, str]:
    """Files of older and of newer format versions."""
    path, content = _stored(folder)
    versions = [v for v in range(1, 2 + FORMAT_VERSION) if v != FORMAT_VERSION]
    return _refused(path, [partial(_with_version, content, versions[k % len(versions)]) for k in range(times)])


def _with_version(content: bytes, version: int, path: Path) -> None:
    import h5py

    path.write_bytes(content)
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = version
    seal(path)


def _refused(path: Path, makers: list[Callable[[Path], None]]) -> tuple[int, int, int, str]:
    survived, said = 0, ""
    for make in makers:
        make(path)
        try:
            read_run(path)
        except RunFileError as error:
            survived, said = survived + (path.name in str(error)), _told(error, path)
    return len(makers), survived, len(makers) - survived, said


def _stored(folder: Path) -> tuple[Path, bytes]:
    path = open_store(folder).put(inputs_of(0), numbered(0), "sample")
    return path, path.read_bytes()


def _told(error: RunFileError, path: Path) -> str:
    return str(error).replace(str(path), path.name)

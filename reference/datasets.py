"""Read contact problems of other projects: LCP text files (plain or gzip), MLCP text, FCLIB HDF5.

`read_problem(path)` chooses the format by the ending of the file's name. Every reader returns a StoredProblem. For a
damaged or unknown file it raises a DatasetError that names the place.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError
from reference.complementarity.problem import ImpactProblem
from reference.fclib import LARGEST_SIZE, DatasetError, StoredProblem, read_fclib

Floats = NDArray[np.float64]

_LARGEST_TEXT = 64 << 20  # unpacked bytes, enough for 2,500 unknowns; a small gzip file can unpack to any size

# Rows of each constraint type of an MLCP file: True for a two-sided row.
_MLCP_ROWS = {
    **{f"MLCP_BILATERAL_{n}D_CONSTRAINT": (True,) * n for n in (1, 2, 3)},
    "MLCP_UNILATERAL_3D_FRICTIONLESS_CONSTRAINT": (False,),
}


def read_problem(path: Path | str) -> StoredProblem:
    """Read a problem file of any known format: .lcp.gz or .lcp, .dat, .txt (MLCP), .hdf5 or .h5 (FCLIB).

    Parameters
    ----------
    path : path of the file; the ending of its name decides the format

    Raises
    ------
    DatasetError
        The file has an unknown format, is damaged or truncated, or is too large; the message says where.
    """
    path = Path(path)
    name = path.name.lower()
    if name.endswith((".hdf5", ".h5")):
        return read_fclib(path)
    if name.endswith(".dat"):
        return read_siconos_lcp(path)
    if name.endswith(".txt"):
        return read_mlcp(path)
    if name.endswith((".lcp", ".lcp.gz")):
        return read_lcp(path)
    raise DatasetError(
        path, "unknown kind of file; known are .lcp, .lcp.gz, .dat, .txt (MLCP), .hdf5 (FCLIB)"
    )


def problem_files(folder: Path | str) -> list[Path]:
    """Return the problem files below `folder`, sorted, without other files."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ArgumentError("folder", str(folder), "an existing folder")
    kinds = (".lcp", ".lcp.gz", ".dat", ".txt", ".hdf5", ".h5")
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.name.lower().endswith(kinds))


def read_lcp(path: Path | str) -> StoredProblem:
    """Read n, M (n x n, row by row) and q of the LCP  0 <= z ⟂ M z + q >= 0  from plain text or gzip (lcpy)."""
    path = Path(path)
    numbers = _numbers(path, _text(path).split())
    n = _count(path, numbers, 0)
    _expect(path, len(numbers), 1 + n * n + n)
    matrix, q = numbers[1 : 1 + n * n].reshape(n, n), numbers[1 + n * n :]
    return StoredProblem(_lcp(path, matrix, q), format="LCP text")


def read_siconos_lcp(path: Path | str) -> StoredProblem:
    """Read a dense LCP of Siconos: size, storage flag 0, sizes, then M **column by column**, and q.

    The files use column order: only in this order does `lcp_Pang_isolated_sol` have a solution, and `lcp_CPS_2` equal
    example 4.4.7 of Cottle, Pang, Stone (1992). A remark may follow the numbers.
    """
    path = Path(path)
    words = _text(path).split()
    head = _numbers(path, words[:6])
    if len(head) < 6:
        raise DatasetError(path, "ends inside its header of six numbers")
    n = _count(path, head, 0)
    if head[1] != 0:
        raise DatasetError(path, f"storage flag {head[1]:g}: only dense storage (0) is read")
    if not (head[2:] == n).all():
        raise DatasetError(path, f"sizes {head[2:].tolist()} differ from the problem's size {n}")
    numbers = _numbers(path, words[6 : 6 + n * n + n])
    _expect(path, len(numbers), n * n + n)
    remark = " ".join(words[6 + n * n + n :])
    problem = _lcp(path, numbers[: n * n].reshape(n, n).T, numbers[n * n :])
    return StoredProblem(problem, remark=remark, format="Siconos LCP")


def read_mlcp(path: Path | str) -> StoredProblem:
    """Read a labelled MLCP text of OpenSurgSim: constraint types, E, HCHt, friction and stored lambda.

    The reader accepts bilateral constraints of one to three dimensions and frictionless unilateral ones; it refuses
    others.
    """
    path = Path(path)
    fields, remark = _labelled(path, _text(path))
    types = fields.get("constraint types", "").split()
    other = sorted(set(types) - set(_MLCP_ROWS))
    if other:
        raise DatasetError(path, f"holds constraints that are not read here: {', '.join(other)}")
    bilateral = np.array([two_sided for kind in types for two_sided in _MLCP_ROWS[kind]], np.bool_)
    q, multipliers = (_bracketed(path, fields, name) for name in ("E", "lambda"))
    matrix = _bracketed(path, fields, "HCHt")
    _expect(path, len(matrix), len(q) ** 2)
    _expect(path, len(multipliers), len(q))
    _expect(path, len(bilateral), len(q))
    joints = bilateral if bilateral.any() else None
    w = matrix.reshape(len(q), len(q))
    problem = ImpactProblem.from_delassus(w, q, bilateral=joints, name=path.name)
    return StoredProblem(problem, multipliers, remark, "MLCP text")


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            packed = file.read(2) == b"\x1f\x8b"
            file.seek(0)
            raw = (gzip.GzipFile(fileobj=file) if packed else file).read(_LARGEST_TEXT + 1)
        if len(raw) > _LARGEST_TEXT:
            raise DatasetError(path, f"larger than {_LARGEST_TEXT >> 20} MB: expected a smaller text file")
        return raw.decode("utf-8")
    except (OSError, EOFError, zlib.error) as error:
        raise DatasetError(path, f"cannot be read: {error}") from error
    except UnicodeDecodeError:
        raise DatasetError(path, "is not a text file") from None


def _numbers(path: Path, words: list[str]) -> Floats:
    try:
        numbers = np.array([float(word) for word in words])
    except ValueError as error:
        raise DatasetError(path, f"number expected: {error}") from None
    if not np.isfinite(numbers).all():
        raise DatasetError(path, "holds a number that is not finite")
    return numbers


def _count(path: Path, numbers: Floats, index: int) -> int:
    if len(numbers) <= index:
        raise DatasetError(path, "is empty")
    n = numbers[index]
    if n != int(n) or not 0 <= n <= LARGEST_SIZE:
        raise DatasetError(path, f"size {n:g}: expected a whole number up to {LARGEST_SIZE}")
    return int(n)


def _expect(path: Path, found: int, expected: int) -> None:
    if found != expected:
        raise DatasetError(path, f"{found} numbers, expected {expected}: damaged or cut off")


def _lcp(path: Path, matrix: Floats, q: Floats) -> ImpactProblem:
    return ImpactProblem.from_delassus(matrix, q, name=path.name)


def _labelled(path: Path, text: str) -> tuple[dict[str, str], str]:
    """Split 'label = value' entries, whose bracketed values may span lines; return them and the title."""
    fields: dict[str, str] = {}
    label, remark = "", ""
    for line in text.splitlines():
        if line.startswith("#"):
            remark = line.lstrip("# ").strip()
        elif line.startswith("=="):
            return fields, remark
        elif " =" in line and not line.startswith(" "):
            label, _, value = (part.strip() for part in line.partition("="))
            fields[label] = value
        elif label:
            fields[label] += " " + line.strip()
    raise DatasetError(path, "has no end mark '== END ==': cut off, or not an MLCP file")


def _bracketed(path: Path, fields: dict[str, str], label: str) -> Floats:
    if label not in fields:
        raise DatasetError(path, f"has no entry {label!r}: not an MLCP file")
    return _numbers(path, fields[label].replace("(", " ").replace(")", " ").split())

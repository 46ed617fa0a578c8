"""Read contact problems of other projects: LCP text files (plain or gzip), MLCP text, FCLIB HDF5.

`read_problem(path)` chooses the format by the ending of the file's name:

- .lcp, .lcp.gz (lcpy): n, M (n x n, row by row) and q of the LCP  0 <= z ⟂ M z + q >= 0.
- .dat (Siconos): size, storage flag 0, four sizes, then M **column by column**, q, and a remark. Only by columns does
  `lcp_Pang_isolated_sol` have a solution, and `lcp_CPS_2` equal example 4.4.7 of Cottle, Pang, Stone (1992).
- .txt (OpenSurgSim): a labelled MLCP with constraint types, E, HCHt, friction and stored lambda; bilateral constraints
  of one to three dimensions and frictionless unilateral ones are read.
- .hdf5, .h5: FCLIB, see `reference.fclib`.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np

from iapb.errors import ArgumentError, MissingDependencyError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.fclib import LARGEST_SIZE, DatasetError, StoredProblem, read_fclib

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
    ending = next((ending for ending in _READERS if path.name.lower().endswith(ending)), None)
    if ending is None:
        raise DatasetError(path, f"unknown kind of file; known are {', '.join(_READERS)}")
    reader = _READERS[ending]
    try:
        return read_fclib(path) if reader is None else reader(path.name, _text(path))
    except (DatasetError, MissingDependencyError):
        raise
    except Exception as error:  # a damaged or foreign file can raise any exception
        raise DatasetError(path, f"cannot be read: {error}") from error


def problem_files(folder: Path | str) -> list[Path]:
    """Return the problem files below `folder`, sorted, without other files."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ArgumentError("folder", str(folder), "an existing folder")
    return sorted(path for path in folder.rglob("*") if path.is_file() and path.name.lower().endswith((*_READERS,)))


def _text(path: Path) -> str:
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        raw = (gzip.GzipFile(fileobj=file) if packed else file).read(_LARGEST_TEXT + 1)
    if len(raw) > _LARGEST_TEXT:
        raise DatasetError(path, f"larger than {_LARGEST_TEXT >> 20} MB: expected a smaller text file")
    return raw.decode("utf-8")


def _lcp(name: str, text: str) -> StoredProblem:
    n, *words = text.split()
    matrix, q = _square(n, words)
    return StoredProblem(ImpactProblem.from_delassus(matrix, q, name=name), format="LCP text")


def _siconos_lcp(name: str, text: str) -> StoredProblem:
    n, flag, *sizes = text.split()[:6]
    words, numbers = text.split()[6:], int(n) * (int(n) + 1)
    if int(flag) != 0 or sizes != [n] * 4:
        raise ValueError(f"storage flag {flag}, sizes {sizes}: expected flag 0 (dense) and four times {n}")
    matrix, q = _square(n, words[:numbers])
    problem = ImpactProblem.from_delassus(matrix.T, q, name=name)
    return StoredProblem(problem, remark=" ".join(words[numbers:]), format="Siconos LCP")


def _mlcp(name: str, text: str) -> StoredProblem:
    fields: dict[str, str] = {}  # of 'label = value' entries, whose bracketed values may span lines
    label, remark, (text, mark, _) = "", "", text.partition("\n==")
    if not mark:
        raise ValueError("has no end mark '== END ==': cut off, or not an MLCP file")
    for line in text.splitlines():
        if line.startswith("#"):
            remark = line.lstrip("# ").strip()
        elif " =" in line and not line.startswith(" "):
            label, _, value = (part.strip() for part in line.partition("="))
            fields[label] = value
        elif label:
            fields[label] += " " + line.strip()
    types = fields["constraint types"].split()
    if other := sorted(set(types) - set(_MLCP_ROWS)):
        raise ValueError(f"holds constraints that are not read here: {', '.join(other)}")
    bilateral = np.array([two_sided for kind in types for two_sided in _MLCP_ROWS[kind]], np.bool_)
    words = {key: fields[key].replace("(", " ").replace(")", " ").split() for key in ("E", "lambda", "HCHt")}
    w, q = _square(str(len(words["E"])), words["HCHt"] + words["E"])
    multipliers = np.array([float(word) for word in words["lambda"]])
    if len(multipliers) != len(q) or not np.isfinite(multipliers).all():
        raise ValueError(f"lambda holds {len(multipliers)} numbers, expected {len(q)} finite ones")
    joints = bilateral if bilateral.any() or len(bilateral) != len(q) else None
    problem = ImpactProblem.from_delassus(w, q, bilateral=joints, name=name)
    return StoredProblem(problem, multipliers, remark, "MLCP text")


def _square(size: str, words: list[str]) -> tuple[Floats, Floats]:
    """Return a matrix (n, n), row by row, and a vector (n,)."""
    n = int(size)
    if not 0 <= n <= LARGEST_SIZE or len(words) != n * n + n:
        raise ValueError(f"size {n} with {len(words)} numbers, expected a size up to {LARGEST_SIZE} and {n * n + n}")
    numbers = np.array([float(word) for word in words])
    return numbers[: n * n].reshape(n, n), numbers[n * n :]


_READERS: dict[str, Callable[[str, str], StoredProblem] | None] = {
    ".lcp": _lcp, ".lcp.gz": _lcp, ".dat": _siconos_lcp, ".txt": _mlcp, ".hdf5": None, ".h5": None,
}

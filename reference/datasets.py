"""Read contact problems of other projects: LCP text files (plain or gzip) and FCLIB HDF5 files.

`read_problem(path)` chooses the format by the ending of the file's name:

- .lcp, .lcp.gz (lcpy): n, M (n x n, row by row) and q of the LCP  0 <= z ⟂ M z + q >= 0.
- .dat (Siconos): size, storage flag 0, four sizes, then M **column by column** and q. Only by
  columns does `lcp_Pang_isolated_sol` have a solution, and `lcp_CPS_2` equal example 4.4.7 of
  Cottle, Pang, Stone (1992).
- .hdf5, .h5: the FrictionalContactLibrary (normal component first). fclib_local : u = W r + q;
  fclib_global : M v = H r + f, u = Hᵀ v + w. Both have friction mu per contact and a solution
  (r, u, v). A solution of zeros counts as absent, because unsolved files have one. A global problem
  is condensed with sparse factors: W = Hᵀ M⁻¹ H, q = w + Hᵀ M⁻¹ f. The result includes its
  mechanics (M, J = Hᵀ) if w = 0 and it has at most WITH_MECHANICS coordinates.

Source: Acary, Brémond, Koziara, Pérignon, FCLIB: a collection of discrete 3D frictional contact
problems (2014).
"""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, IapbError, MissingDependencyError
from iapb.lazy import needed
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.hdf5 import Budget, dataset_at, group_at, values_at

# unknowns: a dense W of 0.8 GB; a header with a larger number counts as damaged
LARGEST_SIZE = 10_000
# rows or columns of a sparse matrix, whose memory depends on its entries only
LARGEST_MATRIX = 1_000_000
WITH_MECHANICS = 2_000  # coordinates up to which a global problem keeps its dense M and J
# unpacked bytes, enough for 2,500 unknowns; a small gzip file can unpack to any size
_LARGEST_TEXT = 64 << 20
_BLOCK = 256  # columns of M⁻¹ H at a time: 25 MB for 12,000 coordinates
# nz of compressed columns and compressed rows; nz >= 0 counts triplets
_COLUMNS = -1
_ROWS = -2


class DatasetError(IapbError, ValueError):
    """A problem file is damaged or has an unknown format."""

    def __init__(self, path: Path | str, problem: str) -> None:
        self.path = Path(path)
        super().__init__(f"{self.path.name}: {problem}")


@dataclass(frozen=True)
class StoredProblem:
    """A problem file as read."""

    problem: ImpactProblem
    stored_impulse: Floats | None = None  #: (n,) multipliers in the file


def read_problem(path: Path | str, budget: int | None = None) -> StoredProblem:
    """Read a problem file of any known format: .lcp.gz or .lcp, .dat, .hdf5 or .h5 (FCLIB).

    Parameters
    ----------
    path : path of the file; the ending of its name decides the format
    budget : bytes that the values of an FCLIB file may fill, by default
        `reference.hdf5.READ_BUDGET`

    Raises
    ------
    DatasetError
        The file has an unknown format, is damaged or truncated, or is too large; the message says
        where.
    MissingDependencyError
        The file is an FCLIB problem, and h5py is not installed.
    """
    path = Path(path)
    readers: list[Any] = [
        reader for ending, reader in _READERS.items() if path.name.lower().endswith(ending)
    ]
    if not readers:
        raise DatasetError(path, f"unknown kind of file; known are {', '.join(_READERS)}")
    try:
        if path.exists() and not path.is_file():
            raise ValueError("no regular file")  # a pipe would be waited for
        return _fclib(path, budget) if readers[0] is _fclib else readers[0](path)
    except MissingDependencyError:
        raise
    except Exception as error:  # a damaged or foreign file can raise any exception
        raise DatasetError(path, f"cannot be read: {' '.join(str(error).split())}") from error


def problem_files(folder: Path | str) -> list[Path]:
    """Return the problem files below `folder`, sorted, without other files."""
    folder = Path(folder)
    if not folder.is_dir():
        raise ArgumentError("folder", str(folder), "an existing folder")
    return sorted(
        path
        for path in folder.rglob("*")
        if path.is_file() and path.name.lower().endswith((*_READERS,))
    )


def _text(path: Path) -> str:
    with path.open("rb") as file:
        packed = file.read(2) == b"\x1f\x8b"
        file.seek(0)
        raw = (gzip.GzipFile(fileobj=file) if packed else file).read(_LARGEST_TEXT + 1)
    if len(raw) > _LARGEST_TEXT:
        raise ValueError(f"larger than {_LARGEST_TEXT >> 20} MB: expected a smaller text file")
    return raw.decode("utf-8")


def _square(size: str, words: list[str]) -> tuple[Floats, Floats]:
    """Return a matrix (n, n), row by row, and a vector (n,)."""
    n = int(size)
    if not 0 <= n <= LARGEST_SIZE or len(words) != n * n + n:
        raise ValueError(
            f"size {n} with {len(words)} numbers, expected a size up to {LARGEST_SIZE} and {n * n + n}"
        )
    numbers = np.array(words, np.float64)
    return numbers[: n * n].reshape(n, n), numbers[n * n :]


def _lcp(path: Path) -> StoredProblem:
    n, *words = _text(path).split()
    return StoredProblem(ImpactProblem.from_delassus(*_square(n, words), name=path.name))


def _siconos_lcp(path: Path) -> StoredProblem:
    n, flag, *words = _text(path).split()
    # a remark may follow
    sizes = words[:4]
    numbers = words[4 : 4 + int(n) * (int(n) + 1)]
    if int(flag) != 0 or sizes != [n] * 4:
        raise ValueError(
            f"storage flag {flag}, sizes {sizes}: expected flag 0 (dense) and four times {n}"
        )
    matrix, q = _square(n, numbers)
    return StoredProblem(ImpactProblem.from_delassus(matrix.T, q, name=path.name))


def _fclib(path: Path, allowed: int | None) -> StoredProblem:
    library = needed("h5py", "FCLIB files")
    with library.File(path, "r") as file:
        budget = Budget(path, file, allowed)
        kind = "fclib_local" if "fclib_local" in list(file) else "fclib_global"
        group = group_at(file, kind)
        given: dict[str, Any] = {
            "restitution": 0.0,
            "friction": _numbers(budget, group, "vectors/mu"),
            "name": path.name,
            "contact_size": index(_numbers(budget, group, "spacedim", None).item()),
        }
        if given["contact_size"] not in (2, 3):
            raise ValueError(f"spacedim {given['contact_size']}: expected 2 or 3")
        if kind == "fclib_global":
            problem = _condensed(budget, group, given)
        else:
            w = _matrix(budget, group_at(group, "W"), LARGEST_SIZE).toarray()
            problem = ImpactProblem.from_delassus(w, _numbers(budget, group, "vectors/q"), **given)
        solved = "solution" in list(file) and "r" in list(group_at(file, "solution"))
        r = _numbers(budget, file, "solution/r") if solved else np.zeros(0)
        # zeros are a placeholder, not a solution
        stored = r if r.any() and len(r) == problem.size else None
        return StoredProblem(problem, stored)


def _condensed(budget: Budget, group: Any, given: dict[str, Any]) -> ImpactProblem:
    """Return a global problem with only its contacts as unknowns."""
    from scipy.sparse.linalg import splu

    mass = _matrix(budget, group_at(group, "M"), LARGEST_MATRIX)
    h = _matrix(budget, group_at(group, "H"), LARGEST_MATRIX)
    f = _numbers(budget, group, "vectors/f")
    w = _numbers(budget, group, "vectors/w")
    if len(w) > LARGEST_SIZE or h.shape != (len(f), len(w)):
        raise ValueError(
            f"H {h.shape}, f {f.shape}, w {w.shape}: expected at most {LARGEST_SIZE} unknowns"
        )
    factors = splu(mass)
    free = factors.solve(f)
    if not w.any() and len(f) <= WITH_MECHANICS:
        return ImpactProblem.from_impact(mass.toarray(), h.T.toarray(), free, **given)
    # w ≠ 0 has no generalized velocity, and a large dense M needs too much memory: return W and q
    # only
    delassus = np.hstack(
        [h.T @ factors.solve(h[:, k : k + _BLOCK].toarray()) for k in range(0, len(w), _BLOCK)]
        or [np.zeros((0, 0))]
    )
    return ImpactProblem.from_delassus(delassus, h.T @ free + w, **given)


def _numbers(budget: Budget, group: Any, name: str, dtype: Any = np.float64) -> NDArray[Any]:
    """Return a dataset of numbers as a vector; its header is checked before it is read."""
    dataset = dataset_at(group, name, budget)
    if dataset.dtype.kind not in "iuf" or dataset.size > LARGEST_SIZE**2:
        raise ValueError(
            f"{name}: {dataset.dtype}, {dataset.shape}: expected at most {LARGEST_SIZE**2} numbers"
        )
    return np.asarray(values_at(group, name, budget), dtype).ravel()


def _matrix(budget: Budget, group: Any, most: int) -> Any:
    """Return a CXSparse matrix as a sparse matrix of compressed columns."""
    from scipy import sparse

    m, n, nz = (index(_numbers(budget, group, key, None).item()) for key in ("m", "n", "nz"))
    i = _numbers(budget, group, "i", None)
    p = _numbers(budget, group, "p", None)
    x = _numbers(budget, group, "x")
    if not (0 <= m <= most and 0 <= n <= most):
        raise ValueError(f"{group.name} of {m} x {n}: expected at most {most} rows and columns")
    if nz in (_ROWS, _COLUMNS):
        compressed = (sparse.csr_matrix if nz == _ROWS else sparse.csc_matrix)(
            (x, i, p), shape=(m, n)
        )
        # an index out of range would write outside the array
        compressed.check_format(full_check=True)
        # not seen by it where the last pointer is 0
        if np.any(compressed.indptr[1:] < compressed.indptr[:-1]):
            raise ValueError(f"{group.name}: the pointers p decrease")
        return compressed.tocsc()
    if not 0 <= nz <= len(x):
        raise ValueError(
            f"{group.name} with nz = {nz}: expected -1, -2 or the number of its entries"
        )
    return sparse.coo_matrix((x[:nz], (i[:nz], p[:nz])), shape=(m, n)).tocsc()


_READERS = {".lcp": _lcp, ".lcp.gz": _lcp, ".dat": _siconos_lcp, ".hdf5": _fclib, ".h5": _fclib}

"""Read and write FCLIB, the HDF5 format of the FrictionalContactLibrary (normal component first).

fclib_local : u = W r + q;  fclib_global : M v = H r + f, u = Hᵀ v + w. Both have friction mu per contact and a
solution (r, u, v). A solution of zeros counts as absent, because unsolved files have one.
Source: Acary, Brémond, Koziara, Pérignon, FCLIB: a collection of discrete 3D frictional contact problems (2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from operator import index
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, IapbError
from iapb.lazy import needed
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.hdf5 import leads_out

LARGEST_SIZE = 10_000  # unknowns: a dense W of 0.8 GB; a header with a larger number counts as damaged
LARGEST_MATRIX = 1_000_000  # rows or columns of a sparse matrix, whose memory depends on its entries only
WITH_MECHANICS = 2_000  # coordinates up to which a global problem keeps its dense M and J


class DatasetError(IapbError, ValueError):
    """A problem file is damaged or has an unknown format."""

    def __init__(self, path: Path | str, problem: str) -> None:
        self.path = Path(path)
        super().__init__(f"{self.path.name}: {problem}")


@dataclass(frozen=True)
class StoredProblem:
    """A problem file as read.

    problem : the ImpactProblem; stored_impulse : (n,) multipliers in the file, or None
    remark : text in the file; format : name of the format
    """

    problem: ImpactProblem
    stored_impulse: Floats | None = None
    remark: str = ""
    format: str = ""


_BLOCK = 256  # columns of M⁻¹ H at a time: 25 MB for 12,000 coordinates
_COLUMNS, _ROWS = -1, -2  # nz of compressed columns and compressed rows; nz >= 0 counts triplets


def read_fclib(path: Path | str) -> StoredProblem:
    """Read a local or global FCLIB problem as an ImpactProblem with friction.

    A global problem is condensed with sparse factors: W = Hᵀ M⁻¹ H, q = w + Hᵀ M⁻¹ f. The result includes its mechanics
    (M, J = Hᵀ) if w = 0 and it has at most WITH_MECHANICS coordinates.

    Parameters
    ----------
    path : path of the HDF5 file

    Raises
    ------
    DatasetError
        The file is not an FCLIB problem, is damaged, or exceeds the size limits of this module.
    MissingDependencyError
        h5py is not installed.
    """
    path, h5py = Path(path), needed("h5py", "FCLIB files")
    try:
        with h5py.File(path, "r") as file:
            if outside := leads_out(file):
                raise ValueError(f"{outside}: expected a file without links to other files")
            kind = "fclib_local" if "fclib_local" in file else "fclib_global"
            group = file[kind]
            if kind == "fclib_global":
                problem = _global(group, path.name)
            else:
                q, mu = _numbers(group, "vectors/q"), _numbers(group, "vectors/mu")
                problem = ImpactProblem.from_delassus(_matrix(group["W"], LARGEST_SIZE).toarray(), q, 0.0, mu,
                                                      contact_size=_spacedim(group), name=path.name)  # fmt: skip
            r = _numbers(file, "solution/r") if "solution/r" in file else np.zeros(0)
            stored = r if r.any() and len(r) == problem.size else None  # zeros are a placeholder, not a solution
            title = bytes(group["info/title"][()]) if "info/title" in group else b""
            return StoredProblem(problem, stored, " ".join(title.decode("utf-8", "replace").rstrip("\0").split()), kind)
    except Exception as error:  # a damaged or foreign HDF5 file can raise any exception
        raise DatasetError(path, f"cannot be read: {' '.join(str(error).split())}") from error


def write_fclib(path: Path | str, problem: ImpactProblem, title: str = "", impulse: Floats | None = None) -> None:
    """Write a problem (and its solution) as fclib_local; W is stored as compressed rows.

    A frictionless problem is written with two zero tangential components per contact and mu = 0. Restitution is
    included in q, because FCLIB has no e; reading the file gives the same complementarity problem with e = 0.
    """
    if problem.relaxed:
        raise ArgumentError("problem", problem.name, "Coulomb's law: FCLIB has no mark for the relaxed one")
    w, q, r, size = problem.delassus, problem.offset, impulse, problem.contact_size
    if size == 1:
        size, normals = 3, np.arange(0, 3 * problem.size, 3)
        w, q = np.zeros((3 * problem.size,) * 2), np.zeros(3 * problem.size)
        w[np.ix_(normals, normals)], q[normals] = problem.delassus, problem.offset
        if impulse is not None:
            r = np.zeros(3 * problem.size)
            r[normals] = impulse
    with needed("h5py", "FCLIB files").File(path, "w") as file:
        group = file.create_group("fclib_local")
        _write_rows(group.create_group("W"), w)
        group["vectors/q"], group["vectors/mu"] = q, problem.friction_or_zero
        group["spacedim"] = np.array([size], np.int32)
        group["info/title"] = np.bytes_(title or problem.name or "iapb")
        if r is not None:
            file["solution/r"], file["solution/u"] = r, w @ r + q


def _global(group: Any, name: str) -> ImpactProblem:
    from scipy.sparse.linalg import splu

    mass, h = _matrix(group["M"], LARGEST_MATRIX), _matrix(group["H"], LARGEST_MATRIX)
    f, w, mu = (_numbers(group, f"vectors/{key}") for key in ("f", "w", "mu"))
    if len(w) > LARGEST_SIZE or h.shape != (len(f), len(w)):
        raise ValueError(f"H {h.shape}, f {f.shape}, w {w.shape}: expected at most {LARGEST_SIZE} unknowns")
    size, factors = _spacedim(group), splu(mass)
    free = factors.solve(f)
    if not w.any() and len(f) <= WITH_MECHANICS:
        return ImpactProblem.from_impact(mass.toarray(), h.T.toarray(), free, 0.0, mu, contact_size=size, name=name)
    # w ≠ 0 has no generalized velocity, and a large dense M needs too much memory: return W and q only
    delassus = np.hstack([h.T @ factors.solve(h[:, k : k + _BLOCK].toarray()) for k in range(0, len(w), _BLOCK)]
                         or [np.zeros((0, 0))])  # fmt: skip
    return ImpactProblem.from_delassus(delassus, h.T @ free + w, 0.0, mu, contact_size=size, name=name)


def _spacedim(group: Any) -> int:
    size = index(_numbers(group, "spacedim", "iu").item())
    if size not in (2, 3):
        raise ValueError(f"spacedim {size}: expected 2 or 3")
    return size


def _numbers(group: Any, name: str, kinds: str = "iuf") -> NDArray[Any]:
    """Return a dataset of finite numbers as a vector; its header is checked before it is read."""
    dataset = group[name]
    if dataset.dtype.kind not in kinds or dataset.size > LARGEST_SIZE**2:
        raise ValueError(f"{name}: {dataset.dtype}, {dataset.shape}: expected at most {LARGEST_SIZE**2} numbers")
    values = np.asarray(dataset[()]).ravel()
    if not np.isfinite(values).all():
        raise ValueError(f"{name} holds a number that is not finite")
    return values if kinds == "iu" else values.astype(np.float64)


def _matrix(group: Any, most: int) -> Any:
    """Return a CXSparse matrix as a sparse matrix of compressed columns."""
    from scipy import sparse

    m, n, nz = (index(_numbers(group, key, "iu").item()) for key in ("m", "n", "nz"))
    i, p, x = _numbers(group, "i", "iu"), _numbers(group, "p", "iu"), _numbers(group, "x")
    if not (0 <= m <= most and 0 <= n <= most):
        raise ValueError(f"{group.name} of {m} x {n}: expected at most {most} rows and columns")
    if nz in (_ROWS, _COLUMNS):
        compressed = (sparse.csr_matrix if nz == _ROWS else sparse.csc_matrix)((x, i, p), shape=(m, n))
        compressed.check_format(full_check=True)  # an index out of range would write outside the array
        return compressed.tocsc()
    if not 0 <= nz <= len(x):
        raise ValueError(f"{group.name} with nz = {nz}: expected -1, -2 or the number of its entries")
    return sparse.coo_matrix((x[:nz], (i[:nz], p[:nz])), shape=(m, n)).tocsc()


def _write_rows(group: Any, matrix: Floats) -> None:
    from scipy import sparse

    rows = sparse.csr_matrix(matrix)
    for name, number in (("m", rows.shape[0]), ("n", rows.shape[1]), ("nz", _ROWS), ("nzmax", rows.nnz)):
        group[name] = np.array([number], np.int32)
    group["i"], group["p"], group["x"] = rows.indices.astype(np.int32), rows.indptr.astype(np.int32), rows.data

"""Read and write FCLIB, the HDF5 format of the FrictionalContactLibrary (normal component first).

fclib_local : u = W r + q;  fclib_global : M v = H r + f, u = Hᵀ v + w. Both have friction mu per contact and a
solution (r, u, v). A solution of zeros counts as absent, because unsolved files have one.
Source: Acary, Brémond, Koziara, Pérignon, FCLIB: a collection of discrete 3D frictional contact problems (2014).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iapb.errors import ArgumentError, IapbError, MissingDependencyError
from reference.complementarity.problem import ImpactProblem
from reference.hdf5 import leads_out

Floats = NDArray[np.float64]

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
    path, h5py = Path(path), _h5py()
    try:
        with h5py.File(path, "r") as file:
            if outside := leads_out(file):
                raise DatasetError(path, f"{outside}: expected a file without links to other files")
            kinds = [name for name in ("fclib_local", "fclib_global") if name in file]
            if not kinds:
                raise DatasetError(path, "is HDF5 but holds neither fclib_local nor fclib_global")
            group = file[kinds[0]]
            reader = _read_local if kinds[0] == "fclib_local" else _read_global
            problem = reader(path, group)
            remark = " ".join(_string(group, "info/title").split())
            return StoredProblem(problem, _stored_impulse(path, file, problem.size), remark, kinds[0])
    except DatasetError:
        raise
    except IapbError as error:
        raise DatasetError(path, str(error)) from error
    except Exception as error:  # a damaged or foreign HDF5 file can raise any exception
        raise DatasetError(path, f"cannot be read: {' '.join(str(error).split())}") from error


def write_fclib(
    path: Path | str, problem: ImpactProblem, title: str = "", impulse: Floats | None = None
) -> None:
    """Write a problem (and its solution) as fclib_local; W is stored as compressed rows.

    A frictionless problem is written with two zero tangential components per contact and mu = 0. Restitution is
    included in q, because FCLIB has no e; reading the file gives the same complementarity problem with e = 0.
    """
    h5py = _h5py()
    w, q, r, size = _three_components(problem, impulse)
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_local")
        _write_rows(group.create_group("W"), w)
        group["vectors/q"], group["vectors/mu"] = q, problem.friction_or_zero
        group["spacedim"] = np.array([size], np.int32)
        group["info/title"] = np.bytes_(title or problem.name or "iapb")
        if r is not None:
            file["solution/r"], file["solution/u"] = r, w @ r + q


def _h5py() -> Any:
    try:
        import h5py
    except ImportError as error:
        raise MissingDependencyError("h5py", "FCLIB files", "pip install h5py") from error
    return h5py


def _read_local(path: Path, group: Any) -> ImpactProblem:
    q, mu = _vector(path, group, "vectors/q"), _vector(path, group, "vectors/mu")
    w = _matrix(path, group["W"], "W").toarray()
    size = _spacedim(path, group, len(mu), len(q))
    return ImpactProblem.from_delassus(w, q, 0.0, mu, contact_size=size, name=path.name)


def _read_global(path: Path, group: Any) -> ImpactProblem:
    from scipy.sparse.linalg import splu

    mass, h = _matrix(path, group["M"], "M"), _matrix(path, group["H"], "H")
    f, w, mu = (_vector(path, group, f"vectors/{name}") for name in ("f", "w", "mu"))
    if mass.shape != (len(f), len(f)) or h.shape != (len(f), len(w)):
        raise DatasetError(path, f"shapes M {mass.shape}, H {h.shape}, f {f.shape}, w {w.shape} do not fit")
    if len(w) > LARGEST_SIZE:
        raise DatasetError(path, f"{len(w)} unknowns: expected at most {LARGEST_SIZE}")
    size, factors = _spacedim(path, group, len(mu), len(w)), splu(mass)
    free = factors.solve(f)
    if not w.any() and len(f) <= WITH_MECHANICS:
        dense, rows = mass.toarray(), h.T.toarray()
        return ImpactProblem.from_impact(dense, rows, free, 0.0, mu, contact_size=size, name=path.name)
    # w ≠ 0 has no generalized velocity, and a large dense M needs too much memory: return W and q only
    delassus = np.hstack([h.T @ factors.solve(h[:, k : k + _BLOCK].toarray()) for k in range(0, len(w), _BLOCK)]
                         or [np.zeros((0, 0))])  # fmt: skip
    return ImpactProblem.from_delassus(delassus, h.T @ free + w, 0.0, mu, contact_size=size, name=path.name)


def _spacedim(path: Path, group: Any, contacts: int, components: int) -> int:
    size = _whole(path, group, "spacedim")
    if size not in (2, 3) or contacts * size != components:
        raise DatasetError(
            path, f"spacedim {size}, {contacts} contacts and {components} components do not fit"
        )
    return size


def _vector(path: Path, group: Any, name: str) -> Floats:
    return _numbers(path, group, name, "iuf").astype(np.float64)


def _numbers(path: Path, group: Any, name: str, kinds: str) -> NDArray[Any]:
    """Return a dataset of real numbers as a vector; its header is checked before it is read."""
    dataset = group[name]
    if not hasattr(dataset, "dtype") or dataset.dtype.kind not in kinds or dataset.shape is None:
        raise DatasetError(path, f"{name} is no dataset of {'whole ' if kinds == 'iu' else ''}numbers")
    if dataset.size > LARGEST_SIZE**2:
        raise DatasetError(path, f"{name} holds {dataset.size} numbers: more than this reader accepts")
    values = np.asarray(dataset[()]).ravel()
    if not np.isfinite(values).all():
        raise DatasetError(path, f"{name} holds a number that is not finite")
    return values


def _whole(path: Path, group: Any, name: str) -> int:
    values = _numbers(path, group, name, "iu")
    if len(values) != 1:
        raise DatasetError(path, f"{name} holds {len(values)} numbers: expected one")
    return int(values[0])


def _string(group: Any, name: str) -> str:
    return bytes(group[name][()]).decode("utf-8", "replace").rstrip("\0") if name in group else ""


def _matrix(path: Path, group: Any, name: str) -> Any:
    """Return a CXSparse matrix as a sparse matrix of compressed columns."""
    from scipy import sparse

    m, n, nz = (_whole(path, group, key) for key in ("m", "n", "nz"))
    i, p, x = (_numbers(path, group, key, kinds) for key, kinds in (("i", "iu"), ("p", "iu"), ("x", "iuf")))
    most = LARGEST_SIZE if name == "W" else LARGEST_MATRIX
    if not (0 <= m <= most and 0 <= n <= most and (nz in (_ROWS, _COLUMNS) or 0 <= nz <= len(x))):
        raise DatasetError(path, f"matrix {name} of {m} x {n} with nz = {nz}: expected at most {most} rows and "
                           "columns, and nz -1, -2 or the number of its entries")  # fmt: skip
    try:
        if nz in (_ROWS, _COLUMNS):
            compressed = (sparse.csr_matrix if nz == _ROWS else sparse.csc_matrix)((x, i, p), shape=(m, n))
            compressed.check_format(full_check=True)  # an index out of range would write outside the array
            return compressed.tocsc()
        return sparse.coo_matrix((x[:nz], (i[:nz], p[:nz])), shape=(m, n)).tocsc()
    except (ValueError, IndexError) as error:
        raise DatasetError(path, f"matrix {name} is damaged: {error}") from error


def _stored_impulse(path: Path, file: Any, size: int) -> Floats | None:
    if "solution/r" not in file:
        return None
    r = _vector(path, file, "solution/r")
    return r if r.any() and len(r) == size else None  # zeros are a placeholder, not a solution


def _three_components(
    problem: ImpactProblem, impulse: Floats | None
) -> tuple[Floats, Floats, Floats | None, int]:
    """Return W, q, r and the number of components per contact in FCLIB's layout, which has 2 or 3 components."""
    if problem.relaxed:
        raise ArgumentError("problem", problem.name, "Coulomb's law: FCLIB has no mark for the relaxed one")
    if problem.contact_size > 1:
        return problem.delassus, problem.offset, impulse, problem.contact_size
    n = problem.size
    w, q = np.zeros((3 * n, 3 * n)), np.zeros(3 * n)
    w[::3, ::3], q[::3] = problem.delassus, problem.offset
    if impulse is None:
        return w, q, None, 3
    r = np.zeros(3 * n)
    r[::3] = impulse
    return w, q, r, 3


def _write_rows(group: Any, matrix: Floats) -> None:
    from scipy import sparse

    rows = sparse.csr_matrix(matrix)
    for name, number in (("m", rows.shape[0]), ("n", rows.shape[1]), ("nz", _ROWS), ("nzmax", rows.nnz)):
        group[name] = np.array([number], np.int32)
    group["i"], group["p"], group["x"] = (
        rows.indices.astype(np.int32),
        rows.indptr.astype(np.int32),
        rows.data,
    )

"""Files of the FrictionalContactLibrary, as its own programs lay them out, for tests of the
reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

# values of nz that mark these storages
COMPRESSED_COLUMNS = -1
COMPRESSED_ROWS = -2


def local_file(
    path: Path,
    delassus: ArrayLike,
    offset: ArrayLike,
    friction: ArrayLike,
    impulse: ArrayLike | None = None,
) -> None:
    """Write u = W r + q for contacts in space: W (3k, 3k), q (3k,), mu (k,) and perhaps a solution
    r (3k,)."""
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_local")
        matrix_group(group.create_group("W"), delassus)
        group["vectors/q"] = np.array(offset, float)
        group["vectors/mu"] = np.array(friction, float)
        group["spacedim"] = np.array([3], np.int32)
        group["info/title"] = np.bytes_("sample")
        if impulse is not None:
            file["solution/r"] = np.array(impulse, float)


def matrix_group(group: Any, matrix: Any) -> None:
    """Write a dense matrix as compressed rows, a sparse one as compressed columns."""
    columns = sparse.issparse(matrix)
    packed = (sparse.csc_matrix if columns else sparse.csr_matrix)(matrix, dtype=float)
    sizes = (*packed.shape, COMPRESSED_COLUMNS if columns else COMPRESSED_ROWS, packed.nnz)
    for name, number in zip(("m", "n", "nz", "nzmax"), sizes, strict=True):
        group[name] = np.array([number], np.int32)
    group["i"] = packed.indices.astype(np.int32)
    group["p"] = packed.indptr.astype(np.int32)
    group["x"] = packed.data

"""Small dense matrices without BLAS or LAPACK, because the last bits of their results depend on the processor."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import kernel

Floats = NDArray[np.float64]


def product(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return the product of a matrix (m, n) with a matrix (n, k) or a vector (n,): ``a @ b``."""
    left, right = np.ascontiguousarray(a, np.float64), np.asarray(b, np.float64)
    columns = np.ascontiguousarray(right if right.ndim == 2 else right[:, None])
    out = np.empty((left.shape[0], columns.shape[1]))
    _multiply(left, columns, out)
    return out if right.ndim == 2 else out[:, 0]


def solve(matrix: ArrayLike, right: ArrayLike) -> Floats:
    """Solve matrix · x = right for x (n,), with a matrix (n, n), by Gaussian elimination with row exchanges.

    Raises
    ------
    ZeroDivisionError
        The matrix is singular.
    """
    left, x = np.array(matrix, np.float64, order="C"), np.array(right, np.float64)
    if not _eliminate(left, x):
        raise ZeroDivisionError("singular matrix")
    return x


@kernel
def _multiply(a, b, out):
    for i in range(a.shape[0]):
        for j in range(b.shape[1]):
            total = 0.0
            for k in range(a.shape[1]):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@kernel
def _eliminate(a, x):
    """Overwrite x with the solution; return False if no pivot is left."""
    n = x.shape[0]
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if not abs(a[pivot, k]) > 0.0:
            return False
        if pivot != k:
            for j in range(k, n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            x[k], x[pivot] = x[pivot], x[k]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, n):
                a[i, j] -= factor * a[k, j]
            x[i] -= factor * x[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            x[k] -= a[k, j] * x[j]
        x[k] /= a[k, k]
    return True

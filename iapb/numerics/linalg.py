"""Linear algebra without BLAS and LAPACK, because the last bits of their results depend on the
processor.

3-vectors are tuples of three floats: LLVM keeps them in registers, and a formula stays one line.
Kernels carry no type hints; numba infers them.
"""

from __future__ import annotations

from math import isfinite, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.numerics.compiled import kernel

# 3-vectors, rows of (n, 3) arrays, and frames (n, 3, 3): rotations with the axes as columns.


ZERO = (0.0, 0.0, 0.0)


@kernel
def load(rows, i):
    """Row i of an (n, 3) array."""
    return (rows[i, 0], rows[i, 1], rows[i, 2])


@kernel
def store(rows, i, a):
    """Write a into row i of an (n, 3) array; the address of the row is computed once."""
    put(rows[i], 0, a)


@kernel
def three(v, k):
    """Entries k to k + 2 of a vector."""
    return (v[k], v[k + 1], v[k + 2])


@kernel
def put(v, k, a):
    """Write a into entries k to k + 2 of a vector."""
    v[k] = a[0]
    v[k + 1] = a[1]
    v[k + 2] = a[2]


@kernel
def accumulate(rows, i, a):
    """Add a to row i of an (n, 3) array."""
    store(rows, i, add(load(rows, i), a))


@kernel
def add(a, b):
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def subtract(a, b):
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(s, a):
    """s a."""
    return (s * a[0], s * a[1], s * a[2])


@kernel
def divide(a, s):
    """a / s."""
    return (a[0] / s, a[1] / s, a[2] / s)


@kernel
def dot(a, b):
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def norm(a):
    """|a|."""
    return sqrt(dot(a, a))


@kernel
def cross(a, b):
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def column(frames, i, k):
    """Column k of frames[i]: its k-th axis."""
    return (frames[i, 0, k], frames[i, 1, k], frames[i, 2, k])


@kernel
def transform(frames, i, a):
    """frames[i] a: transform a from the axes of frame i to the axes in which the frame is given."""
    frame = frames[i]
    return (dot(load(frame, 0), a), dot(load(frame, 1), a), dot(load(frame, 2), a))


@kernel
def transform_back(frames, i, a):
    """frames[i]^T a."""
    return (
        dot(column(frames, i, 0), a),
        dot(column(frames, i, 1), a),
        dot(column(frames, i, 2), a),
    )


@kernel
def placed(w, i, a):
    """Return where the point a, given in frame i of the placements w, is in the world; i = −1: a."""
    return a if i < 0 else add(load(w.position, i), transform(w.rotation, i, a))


@kernel
def store_columns(frames, i, x, y, z):
    """frames[i] <- [x y z]."""
    frame = frames[i]
    store(frame, 0, (x[0], y[0], z[0]))
    store(frame, 1, (x[1], y[1], z[1]))
    store(frame, 2, (x[2], y[2], z[2]))


@kernel
def turn_frame(frames, i, x, y, z):
    """frames[i] <- frames[i] [x y z], where x, y, z are the columns of a rotation."""
    store_columns(
        frames, i, transform(frames, i, x), transform(frames, i, y), transform(frames, i, z)
    )


# Vectors of any length


@kernel
def dot_of(a, b):
    """Return a · b over the length of b."""
    total = 0.0
    for k in range(len(b)):
        total += a[k] * b[k]
    return total


@kernel
def norm_of(a):
    """Return the Euclidean length of a vector."""
    return sqrt(dot_of(a, a))


@kernel
def all_finite(vector):
    """Return whether a vector has no NaN and no infinity."""
    sound = True
    for k in range(len(vector)):
        sound = sound and isfinite(vector[k])
    return sound


@kernel
def add_multiple(vector, factor, row):
    """Do vector += factor · row over the length of the vector."""
    for k in range(len(vector)):
        vector[k] += factor * row[k]


@kernel
def multiply_by(vector, factor):
    """Do vector *= factor."""
    for k in range(len(vector)):
        vector[k] *= factor


@kernel
def write_difference(out, a, b):
    """Write a − b over the length of `out`."""
    for k in range(len(out)):
        out[k] = a[k] - b[k]


@kernel
def equal(a, b):
    """Return whether two vectors are equal over the length of a."""
    same = True
    for k in range(len(a)):
        same = same and a[k] == b[k]
    return same


@kernel
def orthogonalize(row, basis, count, overlaps):
    """Remove the first `count` rows of an orthonormal basis from `row`; write the overlaps; return
    |row|² that is left.

    Gram-Schmidt, twice: enough to be orthogonal to rounding (Kahan, in Parlett 1980).
    """
    for j in range(count):
        overlaps[j] = 0.0
    for _ in range(2):
        for j in range(count):
            overlap = dot_of(basis[j], row)
            overlaps[j] += overlap
            add_multiple(row, -overlap, basis[j])
    return dot_of(row, row)


# Cholesky's factor M = L Lᵀ and the substitutions with it


@kernel
def cholesky(mass_matrix, lower):
    """Write L with M = L Lᵀ into `lower`; return 0, or k + 1 if the k-th pivot is not positive."""
    d = len(mass_matrix)
    for k in range(d):
        pivot = mass_matrix[k, k]
        for j in range(k):
            pivot -= lower[k, j] * lower[k, j]
        if not pivot > 0.0:
            return k + 1
        root = sqrt(pivot)
        lower[k, k] = root
        for i in range(k + 1, d):
            entry = mass_matrix[i, k]
            for j in range(k):
                entry -= lower[i, j] * lower[k, j]
            lower[i, k] = entry / root
            lower[k, i] = 0.0
    return 0


@kernel
def cholesky_tree_blocks(matrix, start, stop, lower):
    """Do `cholesky` for each block of a block diagonal M; other entries of `lower` stay; return 0,
    or 1 on failure."""
    for t in range(len(start)):
        i = start[t]
        j = stop[t]
        if cholesky(matrix[i:j, i:j], lower[i:j, i:j]) != 0:
            return 1
    return 0


@kernel
def to_whitened(lower, v, u):
    """Write the whitened velocity u = Lᵀ v, so that KE = ½|u|²."""
    d = len(v)
    for k in range(d):
        total = 0.0
        for i in range(k, d):
            total += lower[i, k] * v[i]
        u[k] = total


@kernel
def from_whitened(lower, u, v):
    """Solve Lᵀ v = u (back substitution)."""
    d = len(u)
    for k in range(d - 1, -1, -1):
        total = u[k]
        for i in range(k + 1, d):
            total -= lower[i, k] * v[i]
        v[k] = total / lower[k, k]


@kernel
def to_momentum(lower, u, momentum):
    """Write the generalized momentum L u."""
    for k in range(len(u)):
        momentum[k] = dot_of(lower[k], u[: k + 1])


@kernel
def whiten_columns(lower, columns, count):
    """Solve L X = columns in place for the first `count` columns: rows of J become columns of Aᵀ =
    L⁻¹ Jᵀ.

    One contact is one column, so the inner loops run over contacts: they are contiguous and
    vectorize without reordering any sum.
    """
    d = len(lower)
    for k in range(d):
        for j in range(k):
            factor = lower[k, j]
            if factor != 0.0:
                for i in range(count):
                    columns[k, i] -= factor * columns[j, i]
        inverse = 1.0 / lower[k, k]
        for i in range(count):
            columns[k, i] *= inverse


@kernel
def solve_mass(lower, force, acceleration):
    """Solve M a = f by forward and back substitution; `force` may be the same array as
    `acceleration`.

    Three measures shorten the chain of dependent operations. Zeros of L are skipped, since a
    product with zero would still wait for the coordinate before. Factors 1 / L_kk replace
    divisions, since they do not depend on the sum. In the back substitution the entry that was
    computed last comes last in the sum.
    """
    d = len(force)
    for k in range(d):
        total = force[k]
        for j in range(k):
            factor = lower[k, j]
            if factor != 0.0:
                total -= factor * acceleration[j]
        acceleration[k] = total * (1.0 / lower[k, k])
    for k in range(d - 1, -1, -1):
        total = acceleration[k]
        for i in range(d - 1, k, -1):
            factor = lower[i, k]
            if factor != 0.0:
                total -= factor * acceleration[i]
        acceleration[k] = total * (1.0 / lower[k, k])


# Small dense matrices, called from Python


def product(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return the product of a matrix (m, n) with a matrix (n, k) or a vector (n,): ``a @ b``."""
    left = np.ascontiguousarray(a, np.float64)
    right = np.asarray(b, np.float64)
    columns = np.ascontiguousarray(right if right.ndim == 2 else right[:, None])
    out = np.empty((len(left), columns.shape[1]))
    _multiply(left, columns, out)
    return out if right.ndim == 2 else out[:, 0]


@kernel
def _multiply(a, b, out):
    for i in range(len(a)):
        for j in range(b.shape[1]):
            out[i, j] = dot_of(a[i], b[:, j])

"""Cholesky factor M = L Lᵀ and its triangular solves, on plain arrays without BLAS."""

from __future__ import annotations

import math

from iapb.compiled import kernel


@kernel
def cholesky(mass_matrix, lower):
    """Write L with M = L Lᵀ into `lower`; return 0, or k + 1 if the k-th pivot is not positive."""
    d = mass_matrix.shape[0]
    for k in range(d):
        pivot = mass_matrix[k, k]
        for j in range(k):
            pivot -= lower[k, j] * lower[k, j]
        if not pivot > 0.0:
            return k + 1
        root = math.sqrt(pivot)
        lower[k, k] = root
        for i in range(k + 1, d):
            entry = mass_matrix[i, k]
            for j in range(k):
                entry -= lower[i, j] * lower[k, j]
            lower[i, k] = entry / root
            lower[k, i] = 0.0
    return 0


@kernel
def to_whitened(lower, v, u):
    """Write the whitened velocity u = Lᵀ v, so that KE = ½|u|²."""
    d = v.shape[0]
    for k in range(d):
        total = 0.0
        for i in range(k, d):
            total += lower[i, k] * v[i]
        u[k] = total


@kernel
def from_whitened(lower, u, v):
    """Solve Lᵀ v = u (back substitution)."""
    d = u.shape[0]
    for k in range(d - 1, -1, -1):
        total = u[k]
        for i in range(k + 1, d):
            total -= lower[i, k] * v[i]
        v[k] = total / lower[k, k]


@kernel
def to_momentum(lower, u, momentum):
    """Write the generalized momentum L u."""
    d = u.shape[0]
    for k in range(d):
        total = 0.0
        for j in range(k + 1):
            total += lower[k, j] * u[j]
        momentum[k] = total


@kernel
def whiten_columns(lower, columns, count):
    """Solve L X = columns in place for the first `count` columns: rows of J become columns of Aᵀ = L⁻¹ Jᵀ.

    One contact is one column, so the inner loops run over contacts: they are contiguous and vectorize without
    reordering any sum.
    """
    d = lower.shape[0]
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
    """Solve M a = f by forward and back substitution; `force` may be the same array as `acceleration`."""
    _solve_block(lower, 0, force.shape[0], force, acceleration)


@kernel
def _solve_block(lower, start, stop, force, acceleration):
    """Do `solve_mass` on coordinates start .. stop.

    Three measures shorten the chain of dependent operations. Zeros of L are skipped, since a product with zero
    would still wait for the coordinate before. Factors 1 / L_kk replace divisions, since they do not depend on the sum.
    In the back substitution the entry that was computed last comes last in the sum.
    """
    for k in range(start, stop):
        total = force[k]
        for j in range(start, k):
            factor = lower[k, j]
            if factor != 0.0:
                total -= factor * acceleration[j]
        acceleration[k] = total * (1.0 / lower[k, k])
    for k in range(stop - 1, start - 1, -1):
        total = acceleration[k]
        for i in range(stop - 1, k, -1):
            factor = lower[i, k]
            if factor != 0.0:
                total -= factor * acceleration[i]
        acceleration[k] = total * (1.0 / lower[k, k])


@kernel
def solve_tree_blocks(lower, start, stop, force, acceleration):
    """Do `solve_mass` for a block diagonal M, tree by tree: linear in the number of trees, with the same bits."""
    for t in range(start.shape[0]):
        _solve_block(lower, start[t], stop[t], force, acceleration)


@kernel
def cholesky_tree_blocks(matrix, start, stop, lower):
    """Do `cholesky` for each block of a block diagonal M; other entries of `lower` stay; return 0, or 1 on failure."""
    for t in range(start.shape[0]):
        i, j = start[t], stop[t]
        if cholesky(matrix[i:j, i:j], lower[i:j, i:j]) != 0:
            return 1
    return 0

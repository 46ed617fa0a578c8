"""The factored impact map u⁺ = u − (1 + e) Q Qᵀ u: equation (21) without a Delassus matrix;
impulses of least norm.

Arrays hold one contact per *column*: `columns[:, i]` is row i of A = J L⁻ᵀ. `work` is an
`ImpactWork`.
"""

from __future__ import annotations

from math import sqrt

from iapb.numerics.compiled import kernel
from iapb.numerics.linalg import add_multiple, dot_of, norm_of, orthogonalize

# A pivot is a residual row of at least this share of the longest one. A short residual has the
# rounding ε / ‖r‖ in its direction. If only one direction is left, all rows tie, and without this
# rule rounding would choose the pivot.
_PIVOT_SHARE = 0.1
# each pass corrects the error of the one before; a vector that no pass leaves long enough is
# rounding
_PASSES = 4
# If orthogonalization leaves less than this share of a direction, it is rounding: no row can push
# along it.
_NOISE = 1e-15


@kernel
def _most_violating(closing, size, count, eligible_above):
    """Return the pivot: the eligible, long enough residual row with the largest |rᵢ·u| / ‖rᵢ‖; −1
    if none."""
    best = -1
    best_speed = -1.0
    longest = 0.0
    for i in range(count):
        longest = max(longest, size[i])
    shortest = max(eligible_above, _PIVOT_SHARE * _PIVOT_SHARE * longest)
    for i in range(count):
        if size[i] > shortest:
            speed = abs(closing[i]) / sqrt(size[i])
            if speed > best_speed:
                best = i
                best_speed = speed
    return best


@kernel
def _next_direction(columns, pivot, basis, rank):
    """Append the pivot's residual row, made orthonormal to the basis; return False if only its
    rounding is left."""
    q = basis[rank, : len(columns)]
    for k in range(len(q)):
        q[k] = columns[k, pivot]
    for turn in range(1 + _PASSES):
        if turn > 0:
            for j in range(rank):
                add_multiple(q, -dot_of(basis[j], q), basis[j])
        left = norm_of(q)
        if left > 0.0:
            for k in range(len(q)):
                q[k] /= left
        # orthogonal to rounding (Kahan, in Parlett 1980), nearly always in the first pass
        if turn > 0 and left > 0.5:
            return True
    return False


@kernel
def orthonormal_basis(d, count, tolerance, budget, work):
    """Write an orthonormal basis of A's row space, most violated rows first; return its size.

    work.columns : unit-scaled rows of A as columns; overwritten by their residuals.  work.u :
        whitened velocity Lᵀ v.
    A residual row is eligible only above `tolerance` × its unit row. At most `budget` rows are
    used; every truncation is passive. Rows 0 … rank − 1 of work.basis are the result.
    """
    columns = work.columns[:d]
    u = work.u[:d]
    closing = work.closing
    size = work.size
    overlap = work.overlap
    closing[:count] = size[:count] = 0.0
    for k in range(d):
        for i in range(count):
            closing[i] += columns[k, i] * u[k]
            size[i] += columns[k, i] * columns[k, i]
    rank = 0
    while rank < d and rank < budget:
        pivot = _most_violating(closing, size, count, tolerance * tolerance)
        if pivot < 0:
            break
        if _next_direction(columns, pivot, work.basis, rank):
            q = work.basis[rank, :d]
            overlap[:count] = size[:count] = 0.0
            for k in range(d):
                for i in range(count):
                    overlap[i] += q[k] * columns[k, i]
            for k in range(d):
                for i in range(count):
                    entry = columns[k, i] - overlap[i] * q[k]
                    columns[k, i] = entry
                    size[i] += entry * entry
            along_q = dot_of(q, u)
            for i in range(count):
                closing[i] -= overlap[i] * along_q
            rank += 1
        size[pivot] = 0.0  # its residual is rounding only
    return rank


@kernel
def along_given_row(work, i, impulse):
    """Return an impulse along unit row i of A as that along the given row; 0 for a row of zeros."""
    return impulse / work.length[i] if work.length[i] > 0.0 else 0.0


@kernel
def minimum_norm_impulses(d, count, rank, length, change, impulses, work):
    """Write the p of least Euclidean norm with Aᵀ p = Δu, for Δu in the span of the basis.

    With B = A Qᵀ (c × r, full column rank) the condition reads Bᵀ p = Q Δu; B = V T by
    twice-applied Gram-Schmidt gives p = V T⁻ᵀ Q Δu. The unit rows of A in work.rows are taken times
    `length` (≥c,).
    """
    minimum_norm_factors(d, count, rank, length, work)
    for j in range(rank):
        work.target[j] = dot_of(work.basis[j], change)
    impulses[:count] = 0.0
    add_minimum_norm(count, rank, work.target, impulses, work)


@kernel
def minimum_norm_factors(d, count, rank, length, work):
    """Factor B = V T: write Vᵀ to work.columns, T to work.triangle; a direction that no row reaches
    becomes zero."""
    tall = work.columns
    triangle = work.triangle
    for j in range(rank):
        for i in range(count):
            total = 0.0
            for k in range(d):
                total += work.rows[k, i] * work.basis[j, k]
            tall[j, i] = total * length[i]
    for j in range(rank):
        row = tall[j, :count]
        before = dot_of(row, row)
        square = orthogonalize(row, tall, j, triangle[:, j])
        reached = square > _NOISE * _NOISE * before
        triangle[j, j] = sqrt(square) if reached else 0.0
        for i in range(count):
            row[i] = row[i] / triangle[j, j] if reached else 0.0


@kernel
def add_minimum_norm(count, rank, target, impulses, work):
    """Add V T⁻ᵀ target to impulses, the least-norm change that adds `target` (rank,) to Bᵀ p;
    overwrite `target`."""
    for j in range(rank):
        total = target[j]
        for m in range(j):
            total -= work.triangle[m, j] * target[m]
        target[j] = total / work.triangle[j, j] if work.triangle[j, j] > 0.0 else 0.0
    for j in range(rank):
        add_multiple(impulses[:count], target[j], work.columns[j])

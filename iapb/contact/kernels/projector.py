"""The factored impact map u⁺ = u − (1 + e) Q Qᵀ u: equation (21) without a Delassus matrix.

Arrays hold one contact per *column*: `columns[:, i]` is row i of A = J L⁻ᵀ.
"""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.linalg import dot_of, orthogonalize

# A pivot is a residual row of at least this share of the longest one. A short residual has the rounding ε / ‖r‖ in its
# direction. If only one direction is left, all rows tie, and without this rule rounding would choose the pivot.
_PIVOT_SHARE = 0.1
_PASSES = 4  # each pass corrects the error of the one before; a vector that no pass leaves long enough is rounding


@kernel
def unit_columns(columns, count, length):
    """Scale every column to unit length (zero columns stay) and write the lengths."""
    d = columns.shape[0]
    for i in range(count):
        length[i] = 0.0
    for k in range(d):
        for i in range(count):
            length[i] += columns[k, i] * columns[k, i]
    for i in range(count):
        length[i] = math.sqrt(length[i])
    for k in range(d):
        for i in range(count):
            if length[i] > 0.0:
                columns[k, i] /= length[i]


@kernel
def _most_violating(closing, size, count, eligible_above):
    """Return the pivot: the eligible, long enough residual row with the largest |rᵢ·u| / ‖rᵢ‖; −1 if none."""
    best = -1
    best_speed = -1.0
    longest = 0.0
    for i in range(count):
        longest = max(longest, size[i])
    shortest = max(eligible_above, _PIVOT_SHARE * _PIVOT_SHARE * longest)
    for i in range(count):
        if size[i] > shortest:
            speed = abs(closing[i]) / math.sqrt(size[i])
            if speed > best_speed:
                best = i
                best_speed = speed
    return best


@kernel
def _next_direction(columns, pivot, basis, rank):
    """Append the pivot's residual row, made orthonormal to the basis; return False if only its rounding is left.

    A vector that a pass shortens by less than half is orthogonal to rounding (Kahan, in Parlett 1980).
    The residual is nearly orthogonal already, so one pass is almost always enough.
    """
    d = columns.shape[0]
    q = basis[rank, :d]
    for k in range(d):
        q[k] = columns[k, pivot]
    _normalize(q)
    for _ in range(_PASSES):
        for j in range(rank):
            overlap = 0.0
            for k in range(d):
                overlap += basis[j, k] * q[k]
            for k in range(d):
                q[k] -= overlap * basis[j, k]
        left = _normalize(q)
        if left > 0.5:
            return True
    return False


@kernel
def _normalize(q):
    """Scale q to unit length in place and return the length it had; a zero vector stays."""
    square = 0.0
    for k in range(q.shape[0]):
        square += q[k] * q[k]
    length = math.sqrt(square)
    if length > 0.0:
        for k in range(q.shape[0]):
            q[k] /= length
    return length


@kernel
def _deflate(columns, count, q, along_q, closing, size, overlap):
    """Remove the direction q from every residual row; update rᵢ·u and ‖rᵢ‖²."""
    d = columns.shape[0]
    for i in range(count):
        overlap[i] = 0.0
        size[i] = 0.0
    for k in range(d):
        factor = q[k]
        for i in range(count):
            overlap[i] += factor * columns[k, i]
    for k in range(d):
        factor = q[k]
        for i in range(count):
            entry = columns[k, i] - overlap[i] * factor
            columns[k, i] = entry
            size[i] += entry * entry
    for i in range(count):
        closing[i] -= overlap[i] * along_q


@kernel
def orthonormal_basis(columns, count, u, tolerance, budget, basis, closing, size, overlap):
    """Write an orthonormal basis of A's row space, most violated rows first; return its size.

    Parameters
    ----------
    columns : (d, ≥count) unit-scaled rows of A as columns; overwritten by their residuals.
    u : (d,) whitened velocity Lᵀ v.
    tolerance : a residual row is eligible only above `tolerance` × its unit row.
    budget : largest number of rows to use. Every truncation is passive.
    basis : (≥d, ≥d) output, rows 0 … rank − 1.
    closing, size, overlap : (≥count,) scratch.
    """
    d = u.shape[0]
    for i in range(count):
        closing[i] = 0.0
        size[i] = 0.0
    for k in range(d):
        for i in range(count):
            closing[i] += columns[k, i] * u[k]
            size[i] += columns[k, i] * columns[k, i]
    rank = 0
    while rank < d and rank < budget:
        pivot = _most_violating(closing, size, count, tolerance * tolerance)
        if pivot < 0:
            break
        if not _next_direction(columns, pivot, basis, rank):
            size[pivot] = 0.0
            continue
        q = basis[rank, :d]
        along_q = 0.0
        for k in range(d):
            along_q += q[k] * u[k]
        _deflate(columns, count, q, along_q, closing, size, overlap)
        size[pivot] = 0.0  # its residual is rounding only
        rank += 1
    return rank


@kernel
def projected_change(basis, rank, u, factor, change):
    """Write Δu = −factor · Q Qᵀ u, with factor = 1 + e (21)."""
    d = u.shape[0]
    for k in range(d):
        change[k] = 0.0
    for j in range(rank):
        along = 0.0
        for k in range(d):
            along += basis[j, k] * u[k]
        for k in range(d):
            change[k] -= factor * along * basis[j, k]


# The minimum-norm impulses p among all with Jᵀ p = given generalized impulse.

# If orthogonalization leaves less than this share of a direction, it is rounding: no row can push along it.
_NOISE = 1e-15


@kernel
def minimum_norm_impulses(rows, length, count, basis, rank, change, impulses, tall, triangle, target):
    """Write the p of least Euclidean norm with Aᵀ p = Δu, for Δu in the span of the basis.

    With B = A Qᵀ (c × r, full column rank) the condition reads Bᵀ p = Q Δu; B = V T by twice-applied
    Gram-Schmidt gives p = V T⁻ᵀ Q Δu.

    Parameters
    ----------
    rows, length : unit rows of A as columns (d, ≥c) and their lengths (≥c,) [√kg⁻¹].
    basis, rank : orthonormal rows Q.
    change : (d,) Δu.
    impulses : (≥c,) output [N s].
    tall : (≥rank, ≥c) scratch for Vᵀ.  triangle : (≥rank, ≥rank) scratch for T.  target : (≥rank,) scratch.
    """
    minimum_norm_factors(rows, length, count, change.shape[0], basis, rank, tall, triangle)
    for j in range(rank):
        total = 0.0
        for k in range(change.shape[0]):
            total += basis[j, k] * change[k]
        target[j] = total
    for i in range(count):
        impulses[i] = 0.0
    add_minimum_norm(count, rank, target, tall, triangle, impulses)


@kernel
def minimum_norm_factors(rows, length, count, d, basis, rank, tall, triangle):
    """Factor B = A Qᵀ = V T: write Vᵀ into `tall`, T into `triangle`; a direction that no row reaches becomes zero."""
    for j in range(rank):
        for i in range(count):
            total = 0.0
            for k in range(d):
                total += rows[k, i] * basis[j, k]
            tall[j, i] = total * length[i]
    for j in range(rank):
        before = dot_of(tall[j], tall[j, :count])
        square = orthogonalize(tall, j, count, triangle)
        reached = square > _NOISE * _NOISE * before
        triangle[j, j] = math.sqrt(square) if reached else 0.0
        for i in range(count):
            tall[j, i] = tall[j, i] / triangle[j, j] if reached else 0.0


@kernel
def add_minimum_norm(count, rank, target, tall, triangle, impulses):
    """Add V T⁻ᵀ target to impulses, the least-norm change that adds `target` (rank,) to Bᵀ p; overwrite `target`."""
    for j in range(rank):
        total = target[j]
        for m in range(j):
            total -= triangle[m, j] * target[m]
        target[j] = total / triangle[j, j] if triangle[j, j] > 0.0 else 0.0
    for j in range(rank):
        for i in range(count):
            impulses[i] += tall[j, i] * target[j]


@kernel
def subtract_pushed(count, rank, impulses, tall, triangle, along, target):
    """Subtract Bᵀ p = Tᵀ Vᵀ p from `target` (rank,); `along` (≥rank,) is scratch."""
    for j in range(rank):
        along[j] = 0.0
        for i in range(count):
            along[j] += tall[j, i] * impulses[i]
    for j in range(rank):
        for m in range(j + 1):
            target[j] -= triangle[m, j] * along[m]

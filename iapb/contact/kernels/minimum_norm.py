"""The minimum-norm impulses p among all with Jᵀ p = given generalized impulse."""

from __future__ import annotations

import math

from iapb.compiled import kernel

# A direction of which less than this share is left after orthogonalization is rounding: no row can push along it.
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
    """B = A Qᵀ = V T: write Vᵀ into `tall` and T into `triangle`; a direction that no row reaches becomes zero."""
    for j in range(rank):
        for i in range(count):
            total = 0.0
            for k in range(d):
                total += rows[k, i] * basis[j, k]
            tall[j, i] = total * length[i]
    for j in range(rank):
        before = 0.0
        for i in range(count):
            before += tall[j, i] * tall[j, i]
        for m in range(j):
            triangle[m, j] = 0.0
        for _ in range(2):  # twice is enough for orthogonality to rounding
            for m in range(j):
                overlap = 0.0
                for i in range(count):
                    overlap += tall[m, i] * tall[j, i]
                triangle[m, j] += overlap
                for i in range(count):
                    tall[j, i] -= overlap * tall[m, i]
        square = 0.0
        for i in range(count):
            square += tall[j, i] * tall[j, i]
        reached = square > _NOISE * _NOISE * before
        triangle[j, j] = math.sqrt(square) if reached else 0.0
        for i in range(count):
            tall[j, i] = tall[j, i] / triangle[j, j] if reached else 0.0


@kernel
def add_minimum_norm(count, rank, target, tall, triangle, impulses):
    """impulses += V T⁻ᵀ target, the least change by which Bᵀ p grows by `target` (rank,), which is overwritten."""
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
    """target (rank,) −= Bᵀ p = Tᵀ Vᵀ p; `along` (≥rank,) is scratch."""
    for j in range(rank):
        along[j] = 0.0
        for i in range(count):
            along[j] += tall[j, i] * impulses[i]
    for j in range(rank):
        for m in range(j + 1):
            target[j] -= triangle[m, j] * along[m]

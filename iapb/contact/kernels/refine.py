"""Make an impact exact for M itself, where Cholesky's backward error would let L Lᵀ ≠ M be felt."""

from __future__ import annotations

import math

from iapb.compiled import kernel
from iapb.double_double import add_product
from iapb.mechanics.kernels.cholesky import from_whitened

# The factor's error |E| below this share is left to the energy clamp: it moves energy and restitution by as little.
_FELT = 1e-12
_CONTRACTS = 0.1  # above this share the fixed point below may not converge; the clamp then has the last word
_PASSES = 3  # each multiplies what is left by |E|, about d ε κ(M): 1e-3 at κ(M) = 1e12


@kernel
def refine_change(mass_matrix, lower, basis, rank, change, v_change, deviation, along, shifted):
    """Replace Δu = change of (21) by the one that M, not L Lᵀ, calls for.

    In whitened coordinates M is I + E with |E| about d ε κ(M). Wanted is a Δu whose part in the row space is the
    given one (restitution) and whose impulse (I + E) Δu lies in the row space: Δu ← Δu₀ − (I − Q Qᵀ) E Δu, with
    E Δu = L⁻¹ M Δv − Δu and M Δv summed in double-double. Without this the clamp alone would answer for E,
    and it pays in restitution.

    change : (d,) Δu₀ in span Q; on return L⁻¹ of the generalized impulse.
    v_change : (d,) L⁻ᵀ Δu₀; on return Δv.  deviation, along, shifted : (≥d,) scratch.
    """
    d = change.shape[0]
    size = 0.0
    for k in range(d):
        shifted[k] = change[k]
        along[k] = 0.0
        size += change[k] * change[k]
    for _ in range(_PASSES):
        felt = math.sqrt(_deviation(mass_matrix, lower, v_change, shifted, deviation) / size) if size > 0.0 else 0.0
        if not _FELT < felt < _CONTRACTS:
            break
        _split(basis, rank, deviation, along)
        for k in range(d):
            shifted[k] = change[k] - deviation[k]
        from_whitened(lower, shifted[:d], v_change)
    for k in range(d):
        change[k] += along[k]


@kernel
def _deviation(mass_matrix, lower, v_change, shifted, deviation):
    """Write E Δu = L⁻¹ M Δv − Δu; return its square."""
    d = v_change.shape[0]
    square = 0.0
    for i in range(d):
        high = low = 0.0
        for j in range(d):
            high, low = add_product(high, low, mass_matrix[i, j], 0.0, v_change[j])
        total = high + low
        for j in range(i):
            total -= lower[i, j] * (deviation[j] + shifted[j])
        deviation[i] = total / lower[i, i] - shifted[i]
        square += deviation[i] * deviation[i]
    return square


@kernel
def _split(basis, rank, deviation, along):
    """Move the part of `deviation` in the span of the basis to `along`."""
    d = deviation.shape[0]
    for k in range(d):
        along[k] = 0.0
    for j in range(rank):
        overlap = 0.0
        for k in range(d):
            overlap += basis[j, k] * deviation[k]
        for k in range(d):
            along[k] += overlap * basis[j, k]
            deviation[k] -= overlap * basis[j, k]

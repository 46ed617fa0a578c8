"""Batch calls of the engine's impact kernel, as the simulation step calls it: a million impacts take seconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.compiled import block, copy_into, kernel
from iapb.contact.kernels.impact import ImpactWork, factored_impact, rank_tolerance
from iapb.linalg import cholesky
from iapb.schema import zeros_of

Floats = NDArray[np.float64]


def resolve_batch(
    mass_matrix: Floats, columns: Floats, velocity: Floats, restitution: Floats, clamped: bool = True
) -> tuple[Floats, Floats]:
    """Return v⁺ (n, d) and the clamps (n,) of n impacts: M (n, d, d), Jᵀ (n, d, c), v (n, d), e (n,).

    If M is not positive definite to rounding, v⁺ = v and the clamp is −1.
    """
    d, c = columns.shape[1:]
    v_plus, clamps = np.empty_like(velocity), np.empty(len(velocity))
    work = block(zeros_of(ImpactWork, velocity=d, row=c))
    _resolve(mass_matrix, columns, velocity, restitution, clamped, np.empty((d, d)), work, np.empty(d), v_plus, clamps)
    return v_plus, clamps


@kernel
def _resolve(mass_matrix, columns, velocity, restitution, clamped, lower, work, momentum, v_plus, clamps):  # type: ignore[no-untyped-def]
    n, d, c = columns.shape
    for k in range(n):
        for i in range(d):
            for j in range(c):
                work.columns[i, j] = columns[k, i, j]
        if cholesky(mass_matrix[k], lower) != 0:
            clamps[k] = -1.0
            copy_into(v_plus[k], velocity[k])
            continue
        clamps[k] = factored_impact(mass_matrix[k], lower, velocity[k], restitution[k], c, rank_tolerance(lower), d,
                                    clamped, work, v_plus[k], momentum)[1]

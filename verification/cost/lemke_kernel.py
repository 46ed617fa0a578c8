"""The Newton LCP solved by Lemke's method, compiled from M, J, v to v⁺, for a comparison with the
engine's kernel.

The code has plain loops, as the engine's kernels have, because numba takes ten times as long to
compile numpy's linear algebra.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from iapb.linalg import cholesky, from_whitened
from reference.complementarity.solvers.lemke import import_lcp_lemke

lcp_lemke = import_lcp_lemke()


@njit(cache=True)
def repeat_lemke(mass_matrix, rows, v, restitution, v_plus, times):  # type: ignore[no-untyped-def]
    """Resolve the impact of v on rows (c, d) `times` times; write v⁺ (d,), NaN if Lemke's method
    fails."""
    c, d = rows.shape
    lower, whitened = np.zeros((d, d)), np.zeros((c, d))
    delassus, offset = np.zeros((c, c)), np.zeros(c)
    for _ in range(times):
        cholesky(mass_matrix, lower)
        inertia, speed = 0.0, 0.0
        for i in range(c):
            for k in range(d):  # A = J L⁻ᵀ, row by row
                rest = rows[i, k]
                for m in range(k):
                    rest -= lower[k, m] * whitened[i, m]
                whitened[i, k] = rest / lower[k, k]
            for j in range(i + 1):
                delassus[i, j] = delassus[j, i] = np.dot(whitened[i], whitened[j])
            offset[i] = (1.0 + restitution) * np.dot(rows[i], v)
            inertia, speed = max(inertia, delassus[i, i]), max(speed, abs(offset[i]))
        result = lcp_lemke(delassus / inertia, offset / speed)
        v_plus[:] = 0.0
        for i in range(c):
            v_plus += result.z[i] * (speed / inertia) * whitened[i]
        from_whitened(lower, v_plus, v_plus)  # v⁺ = v + L⁻ᵀ Aᵀ p
        v_plus += v
        if not result.success:
            v_plus[:] = np.nan

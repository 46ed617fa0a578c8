"""Other ways to resolve an impact, compiled by numba from M, J, v to v⁺, to compare with the engine.

They call kernels of the engine, as yours may. The code has plain loops, because numba takes ten
times as long to compile numpy's linear algebra.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from iapb.numerics.linalg import add_multiple, cholesky, dot_of, from_whitened, to_whitened
from reference.complementarity.solvers.lemke import import_lcp_lemke

lcp_lemke = import_lcp_lemke()


@njit(cache=True)
def whiten_rows(lower, rows, whitened, square):
    """Write A = J L⁻ᵀ (c, d), row by row, and the squared lengths of its rows (c,)."""
    for i in range(rows.shape[0]):
        for k in range(rows.shape[1]):
            whitened[i, k] = (rows[i, k] - dot_of(lower[k], whitened[i, :k])) / lower[k, k]
        square[i] = dot_of(whitened[i], whitened[i])


@njit(cache=True)
def repeat_lemke(mass_matrix, rows, v, restitution, v_plus, times):
    """Resolve the impact of v on rows (c, d) `times` times; write v⁺ (d,), NaN if Lemke's method
    fails."""
    c, d = rows.shape
    lower = np.zeros((d, d))
    whitened = np.zeros((c, d))
    square = np.zeros(c)
    delassus = np.zeros((c, c))
    offset = np.zeros(c)
    for _ in range(times):
        cholesky(mass_matrix, lower)
        inertia = 0.0
        speed = 0.0
        whiten_rows(lower, rows, whitened, square)
        for i in range(c):
            for j in range(i + 1):
                delassus[i, j] = delassus[j, i] = np.dot(whitened[i], whitened[j])
            offset[i] = (1.0 + restitution) * np.dot(rows[i], v)
            inertia = max(inertia, delassus[i, i])
            speed = max(speed, abs(offset[i]))
        result = lcp_lemke(delassus / inertia, offset / speed)
        v_plus[:] = 0.0
        for i in range(c):
            v_plus += result.z[i] * (speed / inertia) * whitened[i]
        from_whitened(lower, v_plus, v_plus)  # v⁺ = v + L⁻ᵀ Aᵀ p
        v_plus += v
        if not result.success:
            v_plus[:] = np.nan


@njit(cache=True)
def repeat_sweeps(
    mass_matrix,
    lower,
    v,
    restitution,
    rows,
    sweeps,
    whitened,
    share,
    impulses,
    wanted,
    v_plus,
    times,
):
    """Solve Newton's LCP `times` times by sweeps of projected Gauss-Seidel over the contacts, as
    physics engines do.

    It forms no Delassus matrix: each contact reads u and corrects it. `whitened` is A (c, d);
    `share` holds the squared lengths of its rows, `wanted` the velocity that each contact should
    have afterwards.
    """
    for _ in range(times):
        cholesky(mass_matrix, lower)
        to_whitened(lower, v, v_plus)
        whiten_rows(lower, rows, whitened, share)
        for i in range(rows.shape[0]):
            impulses[i] = 0.0
            wanted[i] = -restitution * dot_of(rows[i], v)
        for _sweep in range(sweeps):
            for i in range(rows.shape[0]):
                if share[i] > 0.0:
                    impulse = max(
                        0.0, impulses[i] - (dot_of(whitened[i], v_plus) - wanted[i]) / share[i]
                    )
                    add_multiple(v_plus, impulse - impulses[i], whitened[i])
                    impulses[i] = impulse
        from_whitened(lower, v_plus, v_plus)


@njit(cache=True)
def pose_velocity_form(mass_matrix, lower, rows, v, restitution, unit, least):
    """Write unit rows of A (c, d) and bounds b (c,) of  min ½|x|², A x ≥ b  with |b| ≤ 1; return
    the scale of b.

    x is the change of u = Lᵀ v, divided by the scale.
    """
    cholesky(mass_matrix, lower)
    whiten_rows(lower, rows, unit, least)
    scale = 0.0
    for i in range(rows.shape[0]):
        length = math.sqrt(least[i]) if least[i] > 0.0 else 1.0
        for k in range(rows.shape[1]):
            unit[i, k] /= length
        least[i] = -(1.0 + restitution) * dot_of(rows[i], v) / length
        scale = max(scale, abs(least[i]))
    if scale == 0.0:
        scale = 1.0
    for i in range(rows.shape[0]):
        least[i] /= scale
    return scale


@njit(cache=True)
def velocity_of_form(lower, x, scale, v, v_plus):
    """Write v⁺ (d,) for the solution x of the form that `pose_velocity_form` poses."""
    from_whitened(lower, x, v_plus)
    for i in range(v.shape[0]):
        v_plus[i] = v[i] + scale * v_plus[i]

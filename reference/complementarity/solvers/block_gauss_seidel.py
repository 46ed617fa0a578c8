"""Nonsmooth block Gauss-Seidel (NSGS): sweep contacts and joints; each contact's impulse is projected on its cone.

p_k <- proj_K(p_k − rho_k (u_k + shift_k)), a few times per contact and sweep. Here shift = mu |u_T| is that of
Coulomb's law (none if relaxed), and 1/rho_k is the largest eigenvalue of the contact's own block of W.
Source: Jourdan, Alart, Jean, Comput. Methods Appl. Mech. Eng. 155 (1998); Acary and Brogliato (2008), section 13.7.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_SWEEPS = 20_000
_INNER = (
    4  # projections per contact and sweep; one is enough for a scalar block, friction blocks need more
)
_STILL = 1e-13  # stop after a sweep that changes no contact velocity by more than this share of the scale


@numba.njit(cache=True, fastmath=False)
def _project(p, mu):  # type: ignore[no-untyped-def]
    """Project p (m,) on Coulomb's cone, in place."""
    tangent = 0.0
    for j in range(1, len(p)):
        tangent += p[j] * p[j]
    tangent = math.sqrt(tangent)
    if p[0] >= 0.0 and tangent <= mu * p[0]:
        return
    if mu * tangent <= -p[0]:
        p[:] = 0.0
        return
    height = (p[0] + mu * tangent) / (1.0 + mu * mu)
    p[0] = height
    for j in range(1, len(p)):
        p[j] *= mu * height / tangent


@numba.njit(cache=True, fastmath=False)
def _sweep_until_still(w, b, mu, joints, inertia, relaxed, p, u, trial, sweeps, still):  # type: ignore[no-untyped-def]
    """Sweep in place; return the number of sweeps done, or -1 if the limit is reached."""
    size = len(trial)
    for sweep in range(sweeps):
        largest = 0.0
        for k in range(len(mu)):
            for _ in range(_INNER):
                first, slip = k * size, 0.0
                for i in range(size):
                    u[i] = b[first + i]
                    for j in range(len(b)):
                        u[i] += w[first + i, j] * p[j]
                    if i > 0:
                        slip += u[i] * u[i]
                if not relaxed and not joints[k]:
                    u[0] += mu[k] * math.sqrt(slip)
                for i in range(size):
                    trial[i] = p[first + i] - u[i] / inertia[k]
                if not joints[k]:
                    _project(trial, mu[k])
                for i in range(size):
                    largest = max(largest, abs(trial[i] - p[first + i]) * inertia[k])
                    p[first + i] = trial[i]
        if largest <= still:
            return sweep + 1
    return -1


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse after the last sweep; its residuals show whether it converged."""
    size, k = problem.contact_size, problem.contacts
    blocks = problem.delassus.reshape(k, size, k, size)[np.arange(k), :, np.arange(k)]
    inertia = np.linalg.norm(blocks, ord=2, axis=(1, 2))
    inertia[inertia == 0.0] = 1.0
    p = np.zeros(problem.size)
    done = _sweep_until_still(
        np.ascontiguousarray(problem.delassus), problem.offset, problem.friction_or_zero, problem.two_sided,
        inertia, problem.relaxed, p, np.zeros(size), np.zeros(size), _SWEEPS, _STILL * velocity_scale(problem),
    )  # fmt: skip
    return Answer(p, f"converged after {done} sweeps" if done >= 0 else f"not converged after {_SWEEPS} sweeps")

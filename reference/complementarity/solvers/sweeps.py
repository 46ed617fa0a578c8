"""Sweeps over contacts: projected Gauss-Seidel without friction, nonsmooth block Gauss-Seidel
(NSGS) on the cones.

Without friction, p_i <- max(0, p_i − w_i / W_ii). With friction, p_k <- proj_K(p_k − rho_k (u_k +
shift_k)), a few times per contact and sweep; the shift is mu |u_T| of Coulomb's law (none if
relaxed), and 1/rho_k is the largest eigenvalue of the contact's own block of W. Both end with a
sweep that changes nothing. They converge for symmetric positive semidefinite W if a solution
exists, but slowly for stacks and nearly dependent contacts. Source: Cottle, Pang, Stone (1992),
section 5.3 (projected SOR with factor 1); Jourdan, Alart, Jean, Comput. Methods Appl. Mech. Eng.
155 (1998); Acary and Brogliato (2008), section 13.7.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from iapb.errors import SolverError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_SWEEPS = 20_000
# multiplications, about 2 s: larger frictionless problems get fewer sweeps, but at least
# _LEAST_SWEEPS
_WORK = 1e9
_LEAST_SWEEPS = 500
# Stop after a sweep that changes no contact velocity by more than this share of the scale, without
# and with friction.
_STILL = 1e-14
_STILL_ON_CONES = 1e-13
# projections per contact and sweep: one is enough for a scalar block, friction blocks need more
_INNER = 4


def solve(problem: ImpactProblem) -> Answer:
    """Return the impulse after the last sweep; its residuals show whether it converged."""
    if problem.friction is not None:
        return _on_cones(problem)
    if (np.diag(problem.delassus) < 0.0).any():
        raise SolverError("refused: W has a negative diagonal entry")
    p, done = _projected(problem.delassus, problem.offset, velocity_scale(problem))
    return Answer(
        p, f"converged after {done} sweeps" if done >= 0 else "not converged after the last sweep"
    )


def projected_sweeps(rows: Floats, offset: Floats) -> Floats:
    """Return p (n,) of  0 <= p ⟂ A Aᵀ p + b >= 0  for A (n, d) and b (n,), after the last sweep
    without friction."""
    scale = float(np.abs(offset).max(initial=0.0)) or 1.0
    return _projected(rows @ rows.T, offset, scale)[0]


def _projected(w: Floats, b: Floats, scale: float) -> tuple[Floats, int]:
    """Return p (n,) after the last sweep, and the number of sweeps, or -1 if the limit is
    reached."""
    p = np.zeros(len(b))
    sweeps = max(_LEAST_SWEEPS, min(_SWEEPS, int(_WORK / max(1, len(b)) ** 2)))
    return p, _sweep_lines(np.ascontiguousarray(w), b, p, sweeps, _STILL * scale)


@numba.njit(cache=True, fastmath=False)
def _sweep_lines(w, b, p, sweeps, still):  # type: ignore[no-untyped-def]
    n = len(b)
    for sweep in range(sweeps):
        largest = 0.0
        for i in range(n):
            if w[i, i] <= 0.0:
                continue
            velocity = b[i]
            for j in range(n):
                velocity += w[i, j] * p[j]
            moved = max(-p[i], -velocity / w[i, i])
            p[i] += moved
            largest = max(largest, abs(moved) * w[i, i])
        if largest <= still:
            return sweep + 1
    return -1


def settles(problem: ImpactProblem, sweeps: int) -> bool:
    """Whether one of the first sweeps over the friction cones changes nothing."""
    return _on_cones(problem, sweeps).note.startswith("converged")


def _on_cones(problem: ImpactProblem, sweeps: int = _SWEEPS) -> Answer:
    size = problem.contact_size
    k = problem.contacts
    blocks = problem.delassus.reshape(k, size, k, size)[np.arange(k), :, np.arange(k)]
    inertia = np.linalg.norm(blocks, ord=2, axis=(1, 2))
    inertia[inertia == 0.0] = 1.0
    p, done = _sweep_cones(
        np.ascontiguousarray(problem.delassus),
        problem.offset,
        problem.friction_or_zero,
        inertia,
        problem.relaxed,
        size,
        sweeps,
        _STILL_ON_CONES * velocity_scale(problem),
    )
    return Answer(
        p, f"converged after {done} sweeps" if done >= 0 else f"not converged after {sweeps} sweeps"
    )


@numba.njit(cache=True, fastmath=False)
def _sweep_cones(w, b, mu, inertia, relaxed, size, sweeps, still):  # type: ignore[no-untyped-def]
    """Return the impulse, and the number of sweeps until it was still, -1: never."""
    p = np.zeros(len(b))
    u = np.zeros(size)
    trial = np.zeros(size)
    for sweep in range(sweeps):
        largest = 0.0
        for k in range(len(mu)):
            for _ in range(_INNER):
                first = k * size
                slip = 0.0
                for i in range(size):
                    u[i] = b[first + i]
                    for j in range(len(b)):
                        u[i] += w[first + i, j] * p[j]
                    if i > 0:
                        slip += u[i] * u[i]
                if not relaxed:
                    u[0] += mu[k] * math.sqrt(slip)
                for i in range(size):
                    trial[i] = p[first + i] - u[i] / inertia[k]
                _project(trial, mu[k])
                for i in range(size):
                    largest = max(largest, abs(trial[i] - p[first + i]) * inertia[k])
                    p[first + i] = trial[i]
        if largest <= still:
            return p, sweep + 1
    return p, -1


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
    p[0] = (p[0] + mu * tangent) / (1.0 + mu * mu)
    for j in range(1, len(p)):
        p[j] *= mu * p[0] / tangent

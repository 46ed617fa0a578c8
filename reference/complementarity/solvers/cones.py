"""Contacts with or without friction as programs on Coulomb's cones, by cvxpy's backends.

The cone program is the relaxed law,  min ½|Aᵀp|² + bᵀp  over the cones, or p >= 0. Coulomb's law is
that program with the shift mu |u_T| of the last solution added to the normal part of b. The shift
depends on the solution, so the program is solved repeatedly until the shift is constant
(convergence is not guaranteed). Source: Anitescu and Tasora, Comput. Optim. Appl. 47 (2010); Acary,
Cadoux, Lemaréchal, Malick, ZAMM 91 (2011).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

# of cone programs; change of the shift, share of the velocity scale, at which they stop
_ROUNDS = 50
_STILL = 1e-9
# Backends and accuracy requested at unit W and b; the defaults are 1e-4 to 1e-6. Near the apex of
# cones, the natural map reaches its square root. Without friction, below 1e-11, Clarabel drifts
# along the unbounded set of impulses of opposed contacts (p to 6e9, residual up to 4e-6).
_BACKENDS: dict[str, tuple[str, dict[str, Any]]] = {
    "socp": ("CLARABEL", {"tol_gap_abs": 1e-12, "tol_gap_rel": 1e-12, "tol_feas": 1e-12}),
    "CLARABEL": ("CLARABEL", {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11}),
    "OSQP": (
        "OSQP",
        {
            "eps_abs": 1e-9,
            "eps_rel": 1e-9,
            "max_iter": 20_000,
            "polishing": True,
            "time_limit": 10.0,
        },
    ),
    "SCS": ("SCS", {"eps_abs": 1e-9, "eps_rel": 1e-9, "max_iters": 20_000}),
}


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by programs of _BACKENDS; its residuals show whether it converged.

    The program has the factor A, not a quadratic form of W, because redundant contacts make W rank
    deficient.
    """
    import cvxpy as cp

    backend, settings = _BACKENDS[method]
    rows = problem.factor
    speed = velocity_scale(problem)
    mu = problem.friction_or_zero
    root = float(np.linalg.norm(rows, axis=1).max(initial=0.0)) or 1.0
    # a parameter makes repeated solves cheap
    p = cp.Variable(problem.size)
    offset = cp.Parameter(problem.size)
    blocks = cp.reshape(p, (problem.contact_size, problem.contacts), order="F")
    rough, smooth = (np.flatnonzero(kind) for kind in (mu > 0.0, mu == 0.0))
    cones: list[Any] = []
    if len(rough):
        cones.append(cp.SOC(cp.multiply(mu[rough], blocks[0, rough]), blocks[1:, rough]))
    if len(smooth):
        cones.append(blocks[0, smooth] >= 0.0)
        cones += [blocks[1:, smooth] == 0.0] if problem.contact_size > 1 else []
    program = cp.Problem(cp.Minimize(0.5 * cp.sum_squares((rows.T / root) @ p) + offset @ p), cones)
    shift = np.zeros(problem.contacts)
    for done in range(1, _ROUNDS + 1):
        scaled = problem.offset / speed
        scaled[:: problem.contact_size] += shift
        offset.value = scaled
        try:
            # "may be inaccurate": the status says so too, and residuals are recomputed
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                program.solve(solver=backend, **settings)
        except cp.error.SolverError as error:
            return Answer(None, f"{backend}: {error}")
        impulse = None if p.value is None else np.asarray(p.value) * speed / root**2
        if impulse is None or problem.friction is None or problem.relaxed:
            ended = f" in round {done}" if impulse is None and problem.friction is not None else ""
            return Answer(impulse, f"{backend}: {program.status}{ended}")
        u = problem.contact_velocity(impulse).reshape(-1, problem.contact_size)
        slipping = mu * np.linalg.norm(u[:, 1:], axis=1)
        before = shift
        shift = slipping / speed
        if np.abs(shift - before).max(initial=0.0) <= _STILL:
            return Answer(impulse, f"fixed point after {done} programs")
    return Answer(impulse, f"fixed point not reached in {_ROUNDS} programs")

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
# Backends and accuracies requested at unit W and b, until one has an answer; the defaults are 1e-4
# to 1e-6. Near the apex of cones, the natural map reaches its square root. Without friction, below
# 1e-11, Clarabel drifts along the unbounded set of impulses of opposed contacts (p to 6e9, residual
# up to 4e-6); above, it ends without an answer in one impact of some 5,000.
_BACKENDS: dict[str, tuple[str, tuple[float, ...]]] = {
    "socp": ("CLARABEL", (1e-12, 1e-9)),
    "CLARABEL": ("CLARABEL", (1e-11, 1e-9)),
    "OSQP": ("OSQP", (1e-9,)),
    "SCS": ("SCS", (1e-9,)),
}


def _settings(backend: str, accuracy: float) -> dict[str, Any]:
    """Return cvxpy's arguments for a backend and its accuracy."""
    if backend == "CLARABEL":
        return dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), accuracy)
    settings = {"eps_abs": accuracy, "eps_rel": accuracy}
    if backend == "SCS":
        return settings | {"max_iters": 20_000}
    return settings | {"max_iter": 20_000, "polishing": True, "time_limit": 10.0}


def _attempt(program: Any, backend: str, accuracies: tuple[float, ...]) -> str:
    """Solve at the first accuracy that has an answer; return "", or why none has."""
    import cvxpy as cp

    failure = ""
    for accuracy in accuracies:
        try:
            # "may be inaccurate": the status says so too, and residuals are recomputed
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)
                program.solve(solver=backend, **_settings(backend, accuracy))
        except cp.error.SolverError as error:
            failure = f"{backend}: {error}"
        else:
            return ""
    return failure


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by programs of _BACKENDS; its residuals show whether it converged.

    The program has the factor A, not a quadratic form of W, because redundant contacts make W rank
    deficient.
    """
    import cvxpy as cp

    backend, accuracies = _BACKENDS[method]
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
        failure = _attempt(program, backend, accuracies)
        if failure:
            return Answer(None, failure)
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

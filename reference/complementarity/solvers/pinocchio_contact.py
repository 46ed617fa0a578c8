"""Pinocchio's contact solvers, projected Gauss-Seidel and ADMM, on Coulomb's law or its relaxation.

Pinocchio orders a contact (tangent, tangent, normal), so rows are reordered before and after the
call. Source: Carpentier, Montaut, Le Lidec, From compliant to rigid contact simulation, RSS (2024).
"""

from __future__ import annotations

import numpy as np

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale

_ACCURACY = 1e-12  # requested at unit W and b
_ITERATIONS = 20_000


def solve(problem: ImpactProblem, method: str) -> Answer:
    """Return the impulse by `method` ("PGS" or "ADMM"), whose residuals show whether it
    converged."""
    import pinocchio as pin

    if problem.contact_size != 3:
        raise SolverError("refused: takes contacts of three components only")
    if method == "PGS" and problem.relaxed:
        raise SolverError(
            "refused: pin 4.1 solves Coulomb's law here, whatever its setting solve_ncp says"
        )
    # the order (t, t, n) of every contact
    turned = (np.array([1, 2, 0]) + 3 * np.arange(problem.contacts)[:, None]).ravel()
    inertia = float(np.abs(problem.delassus).max()) or 1.0
    speed = velocity_scale(problem)
    w = np.ascontiguousarray((problem.delassus / inertia)[np.ix_(turned, turned)])
    model = pin.Model()
    models = pin.StdVec_ConstraintModel()
    states = pin.StdVec_ConstraintData()
    for mu in problem.friction_or_zero:  # point contacts of which only the friction is set
        contact = pin.PointContactConstraintModel(model)
        contact.setFriction(float(mu))
        models.append(pin.ConstraintModel(contact))
        states.append(pin.ConstraintModel(contact).createData())
    solver, settings, result = (
        getattr(pin, method + name)()
        for name in ("ConstraintSolver", "SolverSettings", "SolverResult")
    )
    settings.max_iterations = _ITERATIONS
    settings.solve_ncp = not problem.relaxed
    settings.absolute_feasibility_tol = settings.absolute_complementarity_tol = _ACCURACY
    settings.relative_feasibility_tol = settings.relative_complementarity_tol = _ACCURACY
    offset = (problem.offset / speed)[turned]
    done = solver.solve(pin.DelassusOperatorDense(w), offset, models, states, settings, result)
    impulse = np.empty(problem.size)
    impulse[turned] = result.retrieveConstraintImpulses()
    return Answer(
        impulse * speed / inertia,
        f"{method}: converged {done} after {result.iterations} iterations",
    )

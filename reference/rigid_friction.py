"""One rigid step with dry friction in the plane: Coulomb's law, or its convex relaxation, at velocity level.

The step's contacts as blocks (normal, tangent): K ∋ p ⟂ w + mu |w_T| n ∈ K*, where w is J v⁺ − b on the normals
(b of `reference.rigid_step`) and the tangential velocity after the step; `relaxed` drops mu |w_T| (Anitescu).
Source: Stewart and Trinkle (1996); Anitescu and Tasora, Comput. Optim. Appl. 47 (2010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solvers import solve

Floats = NDArray[np.float64]

FRICTION_LAWS = ("none", "coulomb", "relaxed")
# Gauss-Seidel ends at 1e-13 of the velocities where it converges; what it leaves on hyperstatic contacts is above.
FRICTION_TOLERANCE = 1e-8


def friction_step(
    mass_matrix: Floats,
    v_free: Floats,
    normal_rows: Floats,
    tangent_rows: Floats,
    bound: Floats,
    friction: float,
    relaxed: bool = False,
) -> tuple[Floats, Floats, Floats]:
    """Return v⁺ (d,), normal and tangential impulses (c,) [N s] of one step; −inf in `bound` leaves a contact out.

    Raises
    ------
    SolverError
        where Gauss-Seidel does not reach FRICTION_TOLERANCE
    """
    normal, tangential = np.zeros(len(bound)), np.zeros(len(bound))
    kept = np.flatnonzero(np.isfinite(bound))
    if (normal_rows[kept] @ v_free >= bound[kept]).all():
        return v_free, normal, tangential
    rows = np.stack([normal_rows[kept], tangent_rows[kept]], axis=1).reshape(2 * len(kept), -1)
    offset = rows @ v_free
    offset[::2] -= bound[kept]
    w = rows @ np.linalg.solve(mass_matrix, rows.T)
    problem = ImpactProblem.from_delassus(w, offset, 0.0, friction, contact_size=2, relaxed=relaxed)
    solution = solve(problem, "nsgs")
    if not solution.solved(FRICTION_TOLERANCE):
        raise SolverError(f"step with friction: residual {solution.residuals.worst:.1e}, {solution.note}")
    impulse = solution.answer()
    normal[kept], tangential[kept] = impulse[::2], impulse[1::2]
    return v_free + np.linalg.solve(mass_matrix, rows.T @ impulse), normal, tangential

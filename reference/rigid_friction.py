"""One rigid step with dry friction: Coulomb's law, or its convex relaxation, at velocity level, in plane and space.

The step's contacts as blocks (normal, one tangent in the plane or two in space): K ∋ p ⟂ w + mu |w_T| n ∈ K*, where w
is J v⁺ − b on the normals (b of `reference.rigid_step`) and the tangential velocity after the step; `relaxed` drops
mu |w_T| (Anitescu). Contacts that the others' impulses do not make close are left out: solve for those that close,
see which of the rest the answer closes, and solve again with them. The last answer solves the whole problem. Contacts
that no common body ties together (zero blocks of W) are problems of their own: islands.
Source: Stewart and Trinkle (1996); Anitescu and Tasora, Comput. Optim. Appl. 47 (2010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import SOLVED_TOLERANCE, Solution
from reference.complementarity.solvers import solve

Floats = NDArray[np.float64]

FRICTION_LAWS = ("none", "coulomb", "relaxed")
# Gauss-Seidel ends at 1e-13 of the velocities where it converges: such an answer is taken at once. On hyperstatic
# contacts it creeps, and an interior point ends at the root of its own accuracy: then the best of them is taken,
# down to what `reference.complementarity` calls solved.
CONVERGED, FRICTION_TOLERANCE = 1e-8, SOLVED_TOLERANCE
SOLVERS = ("nsgs", "pinocchio_admm", "cvxpy_socp")


def friction_step(
    mass_matrix: Floats,
    v_free: Floats,
    normal_rows: Floats,
    tangent_rows: Floats,
    bound: Floats,
    friction: float,
    relaxed: bool = False,
) -> tuple[Floats, Floats, Floats]:
    """Return v⁺ (d,), normal (c,) and tangential impulses (c, s) [N s] of one step.

    Parameters
    ----------
    normal_rows : (c, d) unit-normal rows; tangent_rows : (c, s, d) rows of s = 1 (plane) or 2 (space) unit tangents
    bound : (c,) of the normal velocities after the step [m/s]; −inf leaves a contact out
    friction : mu > 0, one for all contacts

    Raises
    ------
    SolverError
        where no solver reaches FRICTION_TOLERANCE; says with how many contacts, and what each solver said
    """
    count, size = tangent_rows.shape[0], 1 + tangent_rows.shape[1]
    blocks = np.concatenate([normal_rows[:, None], tangent_rows], axis=1)
    impulse, velocity = np.zeros((count, size)), v_free
    taken = np.zeros(count, np.bool_)
    while (closing := ~taken & (normal_rows @ velocity < bound)).any():
        taken |= closing
        rows = blocks[taken].reshape(-1, len(v_free))
        offset = rows @ v_free
        offset[::size] -= bound[taken]
        response = np.linalg.solve(mass_matrix, rows.T)
        impulse[taken] = _by_islands(rows @ response, offset.reshape(-1, size), friction, relaxed)
        velocity = v_free + response @ impulse[taken].ravel()
    return velocity, impulse[:, 0], impulse[:, 1:]


def _by_islands(w: Floats, offset: Floats, friction: float, relaxed: bool) -> Floats:
    """Return p (k, size) for W (k size, k size) and offset (k, size) [m/s], island by island."""
    from scipy.sparse.csgraph import connected_components

    count, size = offset.shape
    blocks = w.reshape(count, size, count, size)
    islands, island = connected_components((blocks != 0.0).any(axis=(1, 3)), directed=False)
    impulse = np.zeros_like(offset)
    for mine in (np.flatnonzero(island == k) for k in range(islands)):
        part = blocks[mine][:, :, mine].reshape(len(mine) * size, -1)
        problem = ImpactProblem.from_delassus(
            part, offset[mine].ravel(), 0.0, friction, contact_size=size, relaxed=relaxed
        )
        impulse[mine] = _solve(problem).reshape(-1, size)
    return impulse


def _solve(problem: ImpactProblem) -> Floats:
    """Return p (n,) from the first solver that converges, or the best that reaches FRICTION_TOLERANCE."""
    found: list[Solution] = []
    for solver in SOLVERS:
        found.append(solve(problem, solver))
        if found[-1].solved(CONVERGED):
            return found[-1].answer()
    best = min(found, key=lambda solution: solution.residuals.worst)
    if best.solved(FRICTION_TOLERANCE):
        return best.answer()
    said = "; ".join(f"{x.solver}: residual {x.residuals.worst:.1e}, {x.note}" for x in found)
    raise SolverError(
        f"rigid step with friction and {problem.contacts} contacts has no accepted solution: {said}"
    )

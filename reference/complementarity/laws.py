r"""Impact laws: the statement of each, its source, and the hypotheses under which it is consistent.

| law | source | consistent for |
|---|---|---|
| `newton_lcp` | Moreau 1988; Glocker and Pfeiffer 1995 | equal e, or all contacts approach |
| `poisson` | Glocker and Pfeiffer 1995; Anitescu and Potra 1997 | any E in [0, 1], any gamma_minus |
| `newton_equality` | Constantinescu, Salcudean and Croft 2005, (15)-(21) | one e for all contacts |
| `coulomb_ncp` | Moreau 1988; de Saxcé and Feng 1998 | e = 0; with e > 0 it can gain energy |
| `coulomb_ccp` | Anitescu and Tasora 2010; sliding contacts open at mu \|u_T\| | as `coulomb_ncp` |

All laws act on an ImpactProblem with known mechanics (`ImpactProblem.from_impact`) with E =
diag(restitution), and return v⁺ and the impulses. The equality laws share no algorithm with the
engine: they solve A x = target by singular values (lstsq), while the engine orthogonalises rows.

With redundant contacts, many p give the same generalized impulse Jᵀp. A negative entry of the
minimum-norm p alone does not mean adhesion: the contacts pull only if *no* p >= 0 gives the same
Jᵀp (`unpushed_share`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from iapb.errors import ArgumentError, SolverError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import velocity_scale
from reference.complementarity.solvers import solve

# A solution of a law's LCP with a residual above this share of the velocity scale raises an error.
LAW_TOLERANCE = 1e-9
# Solvers for a frictionless LCP, tried in this order. For some redundant rows, active sets cycle
# and Lemke ends on a ray; projections (Gauss-Seidel) do not, but may be slow. Each solution's
# residual is recomputed.
LADDER = ("daqp", "quadprog", "lemke", "gauss_seidel")


@dataclass(frozen=True)
class Outcome:
    """Result of a law for an impact."""

    velocity: Floats  #: (d,) v⁺
    impulse: Floats  #: (n,) p [N s]
    residual: float = 0.0  #: largest recomputed residual of the problems solved


def newton_lcp(problem: ImpactProblem, solver: str | None = None) -> Outcome:
    """Apply Newton's law as an LCP: 0 <= p ⟂ gamma_plus + E gamma_minus >= 0."""
    impulse, residual = _solved(problem, solver)
    return Outcome(problem.velocity_plus(impulse), impulse, residual)


def poisson(problem: ImpactProblem) -> Outcome:
    """Apply Poisson's law, p = p_c + p_e: 0 <= p_c ⟂ gamma_c >= 0, then 0 <= p_e − E p_c ⟂
    gamma_plus >= 0."""
    compression = replace(problem, restitution=np.zeros(problem.contacts))
    p_c, first = _solved(compression)
    returned = problem.restitution * p_c
    bounced = replace(compression, gamma_minus=problem.gamma_plus(p_c + returned))
    extra, second = _solved(bounced, speed=velocity_scale(problem))
    impulse = p_c + returned + extra
    return Outcome(problem.velocity_plus(impulse), impulse, max(first, second))


def newton_equality(problem: ImpactProblem) -> Outcome:
    """Apply gamma_plus = −E gamma_minus on every row, with p of either sign and least norm (the
    paper's (20)-(21)).

    Raises
    ------
    SolverError
        Redundant rows with different e contradict each other, so no velocity satisfies all of them.
    """
    mass = _known(problem.mass_matrix)
    rows = problem.factor
    target = -problem.offset
    if not len(rows):
        return Outcome(_known(problem.velocity), np.zeros(0))
    cholesky = np.linalg.cholesky(mass)
    length = np.linalg.norm(rows, axis=1)
    unit = np.where(length > 0.0, length, 1.0)[:, None]
    # A = J L⁻ᵀ comes from a triangular solve with a relative error up to n ε κ(L). A smaller
    # singular value may be rounding error of dependent rows, and dividing by it would turn noise
    # into impulses.
    dependent = float(max(rows.shape) * np.finfo(np.float64).eps * np.linalg.cond(cholesky))
    change = np.linalg.lstsq(rows / unit, target / unit[:, 0], rcond=dependent)[0]
    shortest = float(unit.min() / unit.max())  # the least norm of p needs the rows without scaling
    impulse = np.linalg.lstsq(rows.T, change, rcond=dependent * shortest)[0]
    residual = float(np.abs(rows @ change - target).max() / (np.abs(target).max() or 1.0))
    if residual > LAW_TOLERANCE:
        raise SolverError(
            f"contradicting equalities on redundant contacts: residual {residual:.1e}"
        )
    return Outcome(
        _known(problem.velocity) + np.linalg.solve(cholesky.T, change), impulse, residual
    )


def coulomb_ncp(problem: ImpactProblem, solver: str = "nsgs") -> Outcome:
    """Apply Coulomb's law K ∋ p ⟂ u + mu |u_T| n ∈ K*, u = gamma_plus + E gamma_minus on the
    normals."""
    return newton_lcp(replace(problem, relaxed=False), solver)


def coulomb_ccp(problem: ImpactProblem, solver: str = "nsgs") -> Outcome:
    """Apply K ∋ p ⟂ u ∈ K*, Coulomb's law without the shift, which is a convex program."""
    return newton_lcp(replace(problem, relaxed=True), solver)


def unpushed_share(columns: np.ndarray, goal: np.ndarray) -> float:
    """Return the least |columns @ p − goal| / |goal| over all p >= 0; 0 if the goal is 0."""
    from scipy.optimize import nnls

    size = float(np.linalg.norm(goal))
    length = np.linalg.norm(columns, axis=0)
    if size == 0.0 or len(length) == 0:
        return 0.0 if size == 0.0 else 1.0
    unit = np.where(length > 0.0, length, 1.0)
    try:
        return float(nnls(columns / unit, goal / size)[1])
    except RuntimeError as error:
        raise SolverError(f"non-negative least squares: {error}") from error


def _solved(
    problem: ImpactProblem, solver: str | None = None, speed: float = 0.0
) -> tuple[Floats, float]:
    """Return p (n,) and its recomputed residual, by that solver or the first of LADDER that reaches
    LAW_TOLERANCE."""
    # Relative to `speed` [m/s] if the problem's own velocities are smaller: after compression, only
    # rounding errors may be left, and opposed rows may contradict each other in them.
    said = []
    own = velocity_scale(problem)
    for name in LADDER if solver is None else (solver,):
        solution = solve(problem, name)
        residual = solution.residuals.worst * own / max(speed, own)
        if residual <= LAW_TOLERANCE:
            return solution.answer(), residual
        said.append(f"{name} left a residual of {residual:.1e}: {solution.note}")
    raise SolverError("; ".join(said))


def _known(mechanics: Floats | None) -> Floats:
    if mechanics is None:
        raise ArgumentError(
            "problem", "without mechanics", "a problem made by ImpactProblem.from_impact"
        )
    return mechanics

"""Enumeration of all sets of active contacts, for small n: finds all solutions, or shows that there
is none.

On an active set a,  W_aa p_a = -b_a, p_a >= 0, and elsewhere p = 0, w >= 0. If W_aa is singular,
the solutions of this piece form a polyhedron; a linear program decides whether it is empty and
returns one point. The tolerances of the linear program are absolute, so it uses D W D and D b with
D_i = 1/√W_ii, scaled to b of size one. This is the same complementarity problem in other units.
Source: Cottle, Pang, Stone (1992), section 1.3 (complementary cones).
"""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np

from iapb.errors import SolverError
from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, residuals

LARGEST_SIZE = 14  # 16384 active sets, some of them linear programs: seconds
_SAME = 1e-9  # two solutions closer than this share of the larger one count as one
# residual below which a candidate is a solution: solves of small systems reach 1e-13
_ACCEPTED = 1e-9
_SINGULAR = 1e-12  # reciprocal condition below which W_aa is taken as singular
# tolerance of the linear program, the least that HiGHS accepts; its default is 1e-7
_FEASIBLE = 1e-10


def all_solutions(problem: ImpactProblem) -> list[Floats]:
    """Return one solution (n,) per active set that has any, fewest contacts first, without
    duplicates."""
    if problem.size > LARGEST_SIZE:
        raise SolverError(
            f"refused: {problem.size} contacts, enumeration takes at most {LARGEST_SIZE}"
        )
    found: list[Floats] = []
    diagonal = np.diag(problem.delassus)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    w = scale[:, None] * problem.delassus * scale
    b = scale * problem.offset
    speed = float(np.abs(b).max(initial=0.0)) or 1.0
    subsets = (combinations(range(problem.size), k) for k in range(problem.size + 1))
    for chosen in chain.from_iterable(subsets):
        unit = _candidate(w, b / speed, list(chosen))
        if unit is None:
            continue
        p = speed * scale * unit
        if residuals(problem, p).worst > _ACCEPTED:
            continue
        if not any(np.allclose(p, q, rtol=0.0, atol=_SAME * np.abs(q).max()) for q in found):
            found.append(p)
    return found


def solve(problem: ImpactProblem) -> Answer:
    """Return the solution with the fewest active contacts; the note gives the number of
    solutions."""
    found = all_solutions(problem)
    if not found:
        return Answer(
            None, f"no active set gives a solution whose residual is at most {_ACCEPTED:.0e}"
        )
    return Answer(found[0], f"{len(found)} solutions found")


def _candidate(w: Floats, b: Floats, active: list[int]) -> Floats | None:
    """Return the solution of one active set; if W_aa is singular, by a linear program the one of
    least sum."""
    from scipy.optimize import linprog

    p = np.zeros(len(b))
    if active:
        columns = w[:, active]
        if np.linalg.cond(columns[active]) * _SINGULAR < 1.0:
            p[active] = np.linalg.solve(columns[active], -b[active])
            return p
        passive = [i for i in range(len(b)) if i not in active]
        accuracy = {
            "primal_feasibility_tolerance": _FEASIBLE,
            "dual_feasibility_tolerance": _FEASIBLE,
        }
        found = linprog(
            np.ones(len(active)),
            -columns[passive],
            b[passive],
            columns[active],
            -b[active],
            (0.0, None),
            "highs",
            options=accuracy,
        )
        if found.x is None:
            return None
        p[active] = found.x
    return p

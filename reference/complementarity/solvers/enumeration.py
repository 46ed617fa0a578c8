"""Enumeration: every choice of active contacts, for small n; finds all solutions, or that there is none.

On an active set a:  W_aa p_a = -b_a, p_a >= 0, p elsewhere 0, w elsewhere >= 0. Where W_aa is singular the
solutions of the piece form a polyhedron: a linear program decides whether it is empty and returns one point.
Source: Cottle, Pang, Stone (1992), section 1.3 (complementary cones).
"""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np
from numpy.typing import NDArray

from iapb.errors import SolverError
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, residuals

Floats = NDArray[np.float64]

LARGEST_SIZE = 14  # 16384 active sets, some of them linear programs: seconds
_SAME = 1e-9  # two solutions closer than this share of the larger are one
_ACCEPTED = 1e-9  # residual below which a candidate is a solution: solves of small systems reach 1e-13
_SINGULAR = 1e-12  # reciprocal condition below which W_aa is taken as singular


def all_solutions(problem: ImpactProblem) -> list[Floats]:
    """Return one solution (n,) per complementary piece that has any, fewest contacts first, no duplicates."""
    if np.count_nonzero(~problem.two_sided) > LARGEST_SIZE:
        raise SolverError(f"refused: {problem.size} contacts, enumeration takes at most {LARGEST_SIZE}")
    found: list[Floats] = []
    joints: list[int] = np.flatnonzero(problem.two_sided).tolist()
    contacts: list[int] = np.flatnonzero(~problem.two_sided).tolist()
    subsets = (combinations(contacts, k) for k in range(len(contacts) + 1))
    for chosen in chain.from_iterable(subsets):
        p = _candidate(problem, sorted([*joints, *chosen]))
        if p is None or residuals(problem, p).worst > _ACCEPTED:
            continue
        if not any(np.allclose(p, q, rtol=0.0, atol=_SAME * np.abs(q).max()) for q in found):
            found.append(p)
    return found


def solve(problem: ImpactProblem) -> Answer:
    """Return the solution with the fewest active contacts; the note says how many there are."""
    found = all_solutions(problem)
    if not found:
        return Answer(None, "no active set gives a solution: the problem has none")
    return Answer(found[0], f"{len(found)} solutions found")


def _candidate(problem: ImpactProblem, active: list[int]) -> Floats | None:
    p = np.zeros(problem.size)
    if not active:
        return p
    block = problem.delassus[np.ix_(active, active)]
    if np.linalg.cond(block) * _SINGULAR < 1.0:
        p[active] = np.linalg.solve(block, -problem.offset[active])
        return p
    return _feasible_point(problem, active)


def _feasible_point(problem: ImpactProblem, active: list[int]) -> Floats | None:
    """Decide by a linear program whether the singular piece holds a solution; return the one of least sum."""
    from scipy.optimize import linprog

    passive = [i for i in range(problem.size) if i not in active]
    w, b = problem.delassus[:, active], problem.offset
    bounds = [(None if problem.two_sided[i] else 0.0, None) for i in active]
    cost = np.where(problem.two_sided[active], 0.0, 1.0)
    result = linprog(cost, -w[passive], b[passive], w[active], -b[active], bounds, method="highs")
    if result.x is None:
        return None
    p = np.zeros(problem.size)
    p[active] = result.x
    return p

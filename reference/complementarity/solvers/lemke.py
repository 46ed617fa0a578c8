"""Lemke's complementary pivoting (quantecon), for any W: find z >= 0 with W z + b >= 0 and z·(W z +
b) = 0.

Source: Lemke, Management Science 11 (1965); Cottle, Pang, Stone, Linear Complementarity (1992),
4.4. With a semidefinite, degenerate W, rounding can end a solvable problem on a ray; a W that
is larger on its diagonal then gives the active set.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale
from reference.complementarity.solvers import import_alone

_SOFTER = 1e-12  # added to the diagonal of a unit W
_APART = 1e-14  # added to a unit b, so that opposed contacts do not tie
_LEAST_PIVOT = 1e-12  # of a unit W: below quantecon's own 1e-7 lie nearly opposed contacts
_PIVOTS = 100  # for each contact: quantecon's own limit of a million lets it cycle for minutes
_STATUS = {0: "solution found", 1: "iteration limit", 2: "ray termination"}


def import_lcp_lemke() -> Callable[..., Any]:
    """Import quantecon's compiled solver, one process at a time."""
    return import_alone("quantecon.optimize").lcp_lemke


def solve(problem: ImpactProblem) -> Answer:
    """Return Lemke's solution, or none if it ends on a ray."""
    lcp_lemke = import_lcp_lemke()
    from quantecon.optimize.linprog_simplex import PivOptions

    inertia = float(np.abs(problem.delassus).max(initial=0.0)) or 1.0
    speed = velocity_scale(problem)
    w = problem.delassus / inertia
    b = problem.offset / speed
    most = _PIVOTS * (problem.size + 1)
    limits = {"max_iter": most, "piv_options": PivOptions(tol_piv=_LEAST_PIVOT)}
    result = lcp_lemke(w, b, **limits)
    if not result.success:  # a W without zero eigenvalues has no rays
        result = lcp_lemke(w + _SOFTER * np.eye(problem.size), b + _APART, **limits)
    # Each pivot adds its rounding: the pushing contacts are solved once more.
    push = np.flatnonzero(result.z > 0.0)
    left = -b[push] - w[push] @ result.z
    result.z[push] += np.linalg.lstsq(w[np.ix_(push, push)], left, rcond=_SOFTER)[0]
    note = f"{_STATUS.get(result.status, result.status)} after {result.num_iter} pivots"
    return Answer(result.z * speed / inertia if result.success else None, note)

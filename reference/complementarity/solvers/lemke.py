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

from reference import Floats
from reference.complementarity.problem import ImpactProblem
from reference.complementarity.solution import Answer, velocity_scale
from reference.complementarity.solvers import import_alone

_PIVOTS = 100  # for each contact: quantecon's own limit of a million lets it cycle for minutes
# Attempts at a unit W, until one solves the problem: the least pivot, and what is added to the
# diagonal. Nearly opposed contacts have small pivots; dependent ones have pivots of rounding; a W
# without zero eigenvalues has no rays.
_ATTEMPTS = ((1e-12, 0.0), (1e-9, 0.0), (1e-7, 0.0), (1e-12, 1e-12), (1e-7, 1e-12))
_APART = 1e-14  # added to a unit b, so that opposed contacts do not tie
_SOLVED = 1e-9  # of a unit b
_STATUS = {0: "solution found", 1: "iteration limit", 2: "ray termination"}


def import_lcp_lemke() -> Callable[..., Any]:
    """Import quantecon's compiled solver, one process at a time."""
    return import_alone("quantecon.optimize").lcp_lemke


def solve(problem: ImpactProblem) -> Answer:
    """Return Lemke's solution, or none if every attempt ends on a ray."""
    lcp_lemke = import_lcp_lemke()
    from quantecon.optimize.linprog_simplex import PivOptions

    inertia = float(np.abs(problem.delassus).max(initial=0.0)) or 1.0
    speed = velocity_scale(problem)
    w = problem.delassus / inertia
    b = problem.offset / speed
    most = _PIVOTS * (problem.size + 1)
    best = Answer(None, "")
    least = np.inf
    for pivot, softer in _ATTEMPTS:
        options = PivOptions(tol_piv=pivot)
        changed = w + softer * np.eye(problem.size)
        apart = _APART if softer else 0.0
        result = lcp_lemke(changed, b + apart, max_iter=most, piv_options=options)
        note = f"{_STATUS.get(result.status, result.status)} after {result.num_iter} pivots"
        z = _solved_again(w, b, result.z)
        if problem.mass_matrix is not None:
            z = _solved_by_rows(problem.factor / np.sqrt(inertia), b, z)
        wrong = float(np.abs(np.minimum(z, w @ z + b)).max(initial=0.0))
        # the contacts that push at the start of a ray can be those of a solution
        if wrong < least and (result.success or wrong <= _SOLVED):
            best = Answer(z * speed / inertia, note)
            least = wrong
        if result.success and wrong <= _SOLVED:
            break
    return best if best.impulse is not None else Answer(None, note)


def _solved_again(w: Floats, b: Floats, z: Floats) -> Floats:
    """Return z with the pushing contacts solved once more: each pivot adds its rounding."""
    push = np.flatnonzero(z > 0.0)
    refined = z.copy()
    left = -b[push] - w[push] @ z
    refined[push] += np.linalg.lstsq(w[np.ix_(push, push)], left, rcond=1e-12)[0]
    return refined


def _solved_by_rows(rows: Floats, b: Floats, z: Floats) -> Floats:
    """Return z with Aᵀz = −y at the pushing contacts, if b = A y: it errs by κ(A), not by κ(W)."""
    motion = np.linalg.lstsq(rows, b, rcond=None)[0]
    if np.abs(rows @ motion - b).max(initial=0.0) > _SOLVED:
        return z
    push = np.flatnonzero(z > 0.0)
    refined = np.zeros(len(z))
    refined[push] = np.linalg.lstsq(rows[push].T, -motion, rcond=1e-12)[0]
    return refined if (refined >= -_SOLVED * np.abs(refined).max(initial=0.0)).all() else z

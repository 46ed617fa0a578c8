"""Resolve a simultaneous impact: equations (19)-(21), in the form that stays passive in floating point.

With M = L Lᵀ, u = Lᵀ v and A = J L⁻ᵀ the paper's (21) is u⁺ = u − (1 + e) P u, P the orthogonal projector onto
the row space of A. `factored` applies P through an orthonormal basis; `gram_pinv` evaluates the formula as printed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iapb.compiled import Entry, block
from iapb.contact.impact_methods import (
    Given,
    ImpactInput,
    Method,
    Whitened,
    as_given,
    damped,
    gram_cholesky,
    gram_pinv,
    outcome,
    poisson,
    refusal,
    scaled,
    stacked,
    svd,
)
from iapb.contact.kernels.border import make_border_work, whole_impact, whole_impacts
from iapb.errors import ArgumentError, RangeError
from iapb.names import one_of

Floats = NDArray[np.float64]

# To add a method, write its function in a new file and add a line here.
METHODS: dict[str, Method] = {
    "factored": Method(None, True),
    "gram_pinv": Method(gram_pinv, False),
    "gram_cholesky": Method(gram_cholesky, False),
    "damped": Method(damped, True),
    "svd": Method(svd, True),
    "poisson": Method(poisson, True),
}


@dataclass(frozen=True)
class Impact:
    """The result of an impact (SI units; d generalized velocities, c contacts).

    Attributes
    ----------
    velocity : (d,) generalized velocity v⁺ after the impact [m/s, rad/s].
    generalized_impulse : (d,) M(v⁺ − v⁻) = Jᵀp [N s, N m s].
    impulses : (c,) p along the contact normals [N s]; a positive value pushes. With redundant rows p is not unique.
        Poisson's law returns the non-negative p that it found; ``damped`` returns the p of least norm for rows scaled
        by powers of two to similar size; the other methods return the p of least norm.
    rank : number of independent rows that were used; for Poisson's law, number of contacts that push.
    energy_change : KE⁺ − KE⁻ [J] of the rounded velocities, evaluated in double-double arithmetic.
    energy_interval : (lower, upper) [J], bounds of KE⁺ − KE⁻ in real arithmetic for the given M and v⁻ and the
        returned v⁺. With the clamp on, the upper bound is never above 0.
    clamp : factor in [0, 1] by which the final energy clamp scaled the change of velocity; 1 = inactive.
    status : ``"complete"``; ``"budget"``: the row budget stopped the method early; ``"not solved"``: a contact still
        closes after Poisson's law, which nearly opposed rows can cause (the energy does not rise in this case either);
        ``"cancelled"``: no change of velocity without an energy gain was found, so v⁺ = v⁻, or the entries of v differ
        by more than 2^1000 in size, so that scaling rounded the smallest.
    method, law : the method that computed the impact, and its restitution law.
    rows_used : the row budget used (None = unlimited); the same budget reproduces the result exactly.
    """

    velocity: Floats
    generalized_impulse: Floats
    impulses: Floats
    rank: int
    energy_change: float
    energy_interval: tuple[float, float]
    clamp: float
    status: str
    method: str
    law: str
    rows_used: int | None = field(default=None)


def resolve_impact(mass_matrix: ArrayLike, contact_jacobian: ArrayLike, velocity: ArrayLike,
                   restitution: ArrayLike, *, method: str = "factored", budget: int | None = None,
                   clamp: bool | None = None, rank_tolerance: float | None = None) -> Impact:
    """Resolve a simultaneous impact: J v⁺ = −e J v⁻ for every row given, with M(v⁺ − v⁻) in range(Jᵀ).

    Every row is an equality, whatever the sign of its velocity. The caller chooses the rows that collide
    (γ < −v_approach, paper section V).

    Parameters
    ----------
    mass_matrix : (d, d) symmetric positive definite M (paper: D) [kg, kg m²].
    contact_jacobian : (c, d) J with one row nᵀJᵢ per contact; n is a unit normal; J v > 0 separates.
        c = 0 and zero, repeated or dependent rows are allowed.
    velocity : (d,) generalized velocity v⁻ before the impact [m/s, rad/s].
    restitution : e in [−1, 1] for all contacts; or (c,) values in [0, 1], one per contact. Unequal values use
        Poisson's law by two LCPs (compression, then restitution; contacts only push), which is passive for
        any such values. Equal values use the scalar rule.
    method : ``factored`` (default, passive in floating point), ``gram_pinv`` (the paper's (20)-(21) as
        printed), ``gram_cholesky`` (independent rows only), ``damped`` (W + λI)⁻¹, ``svd`` (truncated), ``poisson``
        (contacts only push). All others take every row as an equality. ``poisson`` equals Newton's LCP if every row
        approaches and e is one number in [0, 1].
    budget : largest number of rows used, the most violated first (``factored`` only). Every budget is passive.
    clamp : whether to scale Δv so that rounding cannot raise the energy, in real arithmetic. Default: on for
        ``factored``, ``damped``, ``svd`` and Poisson's law, off for the two ``gram`` methods.
    rank_tolerance : a row closer than this to the span of the rows used (unit rows, kinetic metric) is not used.
        Default: 1e-10, or 8 d ε κ(L), the rounding of the rows, where this is larger.

    Returns
    -------
    Impact

    Raises
    ------
    ArgumentError
        Wrong shape, NaN or infinity, M not symmetric positive definite, e outside its range, dependent rows
        with ``gram_cholesky``.
    RangeError
        The result would overflow.

    Notes
    -----
    KE⁺ = KE⁻ − ½(1 − e²) vᵀJᵀ(J M⁻¹ Jᵀ)†J v (Theorem 2, with the factor ½ that the paper omits). In floating
    point the relative energy gain of ``factored`` stays below 10 d ε √κ(M): a refinement removes Cholesky's error
    d ε κ(M), then the energy is clamped. With the clamp no impact gains energy, not even in the last bit: a v⁺ is
    accepted only if a computed bound proves this for the given M (`iapb.contact.kernels.passive`).
    Source: Constantinescu, Salcudean, Croft (2005), section V.
    """
    given = as_given(mass_matrix, contact_jacobian, velocity, restitution)
    solve, clamped_by_default = _method(method)
    if method == "poisson" and given.unequal is None:
        if given.restitution < 0.0:
            raise ArgumentError("restitution", given.restitution, "a number in [0, 1] with method 'poisson'")
        given = given._replace(unequal=np.full(len(given.contact_jacobian), given.restitution))
    _check_options(method, budget, rank_tolerance, given.unequal is None)
    clamped = clamped_by_default if clamp is None else _checked_clamp(clamp)
    limit = _limit(budget, len(given.velocity))
    rows_used = None if budget is None else int(budget)
    law = "Newton, equality"
    if given.unequal is not None:
        solve, law, clamped = poisson, "Poisson, two LCPs", clamp is None or bool(clamp)
    elif solve is None or not len(given.contact_jacobian):
        return _factored(given, rank_tolerance, limit, clamped, method, rows_used)
    problem = scaled(given)
    answer = solve(problem, limit, clamped, rank_tolerance)
    return _as_impact(problem, answer, clamped, method=method, law=law, rows_used=rows_used)


# The texts of the kernel's status codes.
_STATUS = ("complete", "budget", "cancelled")


def _factored(given: Given, tolerance: float | None, limit: int, clamped: bool, method: str,
              rows_used: int | None) -> Impact:
    """Check, scale and resolve by (21) through an orthonormal basis of A's row space, in one compiled call."""
    M, J, v, e, _ = given
    d, c = len(v), len(J)
    v_plus, momentum, impulses = np.empty(d), np.empty(d), np.empty(c)
    wrong, (rank, status), factor, (change, lower, upper) = _entries()[0](
        M, J, v, e, 0.0 if tolerance is None else float(tolerance), limit, clamped, _scratch(d, c), v_plus, momentum,
        impulses)
    if wrong[0]:
        raise refusal(wrong, given, method=method)
    return Impact(v_plus, momentum, impulses, rank, change, (lower, upper), factor, _STATUS[status], method,
                  "Newton, equality", rows_used)


@lru_cache(maxsize=8)
def _scratch(coordinates: int, contacts: int) -> Any:
    """Return scratch that all calls of this size share: a kernel holds the interpreter's lock while it runs."""
    return block(make_border_work(coordinates, contacts))


@lru_cache(maxsize=1)
def _entries() -> tuple[Any, Any]:
    """Return the compiled functions for one impact and for many; calls skip numba's look-up of types."""
    work, e, count = block(make_border_work(1, 1)), np.zeros(1), np.zeros((1, 2), np.int64)
    flat, deep = np.zeros((1, 1)), np.zeros((1, 1, 1))
    one = Entry(whole_impact).taking(flat, flat, e, 0.0, 0.0, 1, True, work, e, e, e)
    many = Entry(whole_impacts).taking(deep, deep, flat, e, 0.0, 1, True, work, flat, flat, flat, count, flat)
    return one, many


@dataclass(frozen=True)
class Impacts:
    """The results of n impacts of d coordinates and c contacts: the attributes of `Impact`, one row per impact.

    Attributes
    ----------
    velocity, generalized_impulse : (n, d).
    impulses : (n, c).
    rank, energy_change, clamp : (n,).
    energy_interval : (n, 2).
    status : (n,) texts.
    """

    velocity: Floats
    generalized_impulse: Floats
    impulses: Floats
    rank: NDArray[np.int64]
    energy_change: Floats
    energy_interval: Floats
    clamp: Floats
    status: NDArray[np.str_]


def resolve_impacts(mass_matrices: ArrayLike, contact_jacobians: ArrayLike, velocities: ArrayLike,
                    restitution: ArrayLike, *, budget: int | None = None, clamp: bool | None = None,
                    rank_tolerance: float | None = None) -> Impacts:
    """Resolve n impacts of equal size in one call, bit for bit as `resolve_impact` with ``factored`` resolves each.

    Parameters
    ----------
    mass_matrices : (n, d, d).
    contact_jacobians : (n, c, d).
    velocities : (n, d).
    restitution : one number in [−1, 1], or (n,), one per impact.
    budget, clamp, rank_tolerance : see `resolve_impact`; one value for all n impacts.

    Returns
    -------
    Impacts
        Velocities after the impacts (n, d), generalized impulses (n, d), impulses of the contacts (n, c), and the other
        attributes of `Impact` for each.

    Raises
    ------
    ArgumentError, RangeError
        As `resolve_impact`, for the first invalid impact. The index in the argument's name begins with the number of
        this impact: ``mass_matrices[17, 0, 0]``.
    """
    M, J, v, e = stacked(mass_matrices, contact_jacobians, velocities, restitution)
    _check_options("factored", budget, rank_tolerance, True)
    clamped = clamp is None or _checked_clamp(clamp)
    n, c, d = J.shape
    v_plus, momentum, impulses = np.empty((n, d)), np.empty((n, d)), np.empty((n, c))
    counts, numbers = np.empty((n, 2), np.int64), np.empty((n, 4))
    wrong, at = _entries()[1](
        M, J, v, e, 0.0 if rank_tolerance is None else float(rank_tolerance), _limit(budget, d), clamped,
        _scratch(d, c), v_plus, momentum, impulses, counts, numbers)
    if wrong[0]:
        raise refusal(wrong, Given(M[at], J[at], v[at], float(e[at]), None), (at,))
    return Impacts(v_plus, momentum, impulses, counts[:, 0], numbers[:, 1], numbers[:, 2:], numbers[:, 0],
                   np.array(_STATUS)[counts[:, 1]])


def _method(method: Any) -> tuple[Any, bool]:
    if not isinstance(method, str) or method not in METHODS:
        raise ArgumentError("method", method, one_of(method, METHODS))
    return METHODS[method]


def _limit(budget: int | None, coordinates: int) -> int:
    """Return the largest number of rows to use, as an integer that fits the kernel."""
    return coordinates if budget is None else min(int(budget), np.iinfo(np.int64).max)


def _checked_clamp(clamp: Any) -> bool:
    if not isinstance(clamp, bool | np.bool_):
        raise ArgumentError("clamp", clamp, "True, False or None")
    return bool(clamp)


def _check_options(method: str, budget: Any, tolerance: Any, equal: bool) -> None:
    if budget is not None:
        if isinstance(budget, bool) or not isinstance(budget, int | np.integer) or budget < 0:
            raise ArgumentError("budget", budget, "a whole number of rows, 0 or more")
        if method != "factored" or not equal:
            raise ArgumentError("budget", budget, "None: only 'factored', with one restitution for all, can stop early")
    number = isinstance(tolerance, float | int | np.floating)
    if tolerance is not None and not (number and 0.0 < tolerance < 1.0):
        raise ArgumentError("rank_tolerance", tolerance, "a number strictly between 0 and 1")


def _as_impact(problem: ImpactInput, answer: Whitened, clamped: bool, *, method: str, law: str,
               rows_used: int | None) -> Impact:
    """Undo the power-of-two scaling and report the energy change of the returned velocity."""
    found = outcome(problem, answer.v_plus, answer.momentum, answer.impulses, clamped)
    for quantity, array in (("velocity", found.velocity), ("generalized_impulse", found.momentum),
                            ("impulses", found.impulses)):
        if not np.isfinite(array).all():
            raise RangeError(quantity, f"the {method} impact of these magnitudes is above 1.8e308")
    if not math.isfinite(found.energy_change):
        raise RangeError("energy_change", "the kinetic energy of these magnitudes is above 1.8e308")
    clamp = answer.clamp * found.factor
    status = "cancelled" if clamp == 0.0 or problem.underflows and problem.contacts else answer.status
    return Impact(found.velocity, found.momentum, found.impulses, answer.rank, found.energy_change,
                  found.energy_interval, clamp, status, method, law, rows_used)

"""Judge an impact method on a hard case: energy, restitution and motion against the exact truth."""

from __future__ import annotations

import statistics
import time
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from iapb.errors import IapbError
from verification.hard_cases.bounded import Answer, OutOfMemory, TimedOut, bounded_impact
from verification.hard_cases.case import EPS, Floats, HardCase
from verification.hard_cases.frictional import FrictionalCase
from verification.hard_cases.verdict import HANGS_ON_ROUNDING, RESTITUTION_TOLERANCE, HardCaseVerdict

WITHOUT_CLAMP = "factored, no clamp"
NEWTON_COULOMB = "Newton with Coulomb"  # friction at an impact as Kane and Levinson found it
METHODS = ("factored", WITHOUT_CLAMP, "gram_pinv", "gram_cholesky", "damped", "svd")
_MARGIN = 100.0  # constant before d ε √κ(M) (√κ(M) + κ(A)), the first-order error of whitening and of the basis
_REPEATS = 5  # their median is reported; the first call, which fills caches, is not among them
_SLOW = 0.2  # a call of more seconds is not repeated
_HALF_SUBNORMAL = Fraction(1, 2**1075)  # rounding of the smallest numbers, which no relative bound covers
_FORM_DELASSUS = ("gram_pinv", "gram_cholesky", "damped")
# Residuals of these are noise that another LAPACK makes anew: 7e-9 to 5e-8 on Kahan's rows, about a tolerance of 1e-8.
_THROUGH_LAPACK = ("gram_pinv", "gram_cholesky", "svd")
_NOISE = 10.0  # factor about the tolerance within which such a residual decides nothing
# A motion that is wrong by more than half of |v⁻| is noise altogether: whether it also gains energy is chance (−1e-3 to
# 1e-4 of it, by BLAS, for the printed formula on rows 1e-4 apart).
_ALL_NOISE = 0.5
_MANY_CONTACTS = 2000  # from here on those get a process that can be cut: W has 4e6 entries, its SVD takes a second


def judge_impact(case: HardCase, method: str) -> HardCaseVerdict:
    """Return the verdict of one method on one impact."""
    d, truth = len(case.velocity), case.truth
    root = float(np.sqrt(truth.condition))
    energy_bound = 10.0 * d * EPS * root
    forward_bound = _MARGIN * d * EPS * root * (root + truth.row_condition) + _rounding_of_small_numbers(case)
    try:
        answer = _answer(case, method)
    except IapbError as error:
        return HardCaseVerdict(case.name, method, _word(error), str(error), energy_bound=energy_bound,
                               forward_bound=forward_bound, exact_rank=truth.rank)  # fmt: skip
    from reference.exact import relative_energy_gain

    gain = relative_energy_gain(case.mass_matrix, case.velocity, answer.velocity)
    residual, distance = _unmet(case, answer.velocity), _forward_error(case, answer.velocity)
    verdict = _verdict(case, gain, energy_bound, residual, distance, forward_bound)
    undecided = verdict != "gains energy" and _near_tolerance(residual)
    noise = verdict in ("gains energy", "restitution unmet") and distance > _ALL_NOISE
    if method in _THROUGH_LAPACK and (undecided or noise):
        verdict = HANGS_ON_ROUNDING
    return HardCaseVerdict(
        case.name, method, verdict, "", gain, energy_bound, residual, distance, forward_bound, answer.rank,
        truth.rank, answer.clamp, answer.seconds,
    )  # fmt: skip


def _word(error: IapbError) -> str:
    """What an error means for the verdict."""
    if isinstance(error, TimedOut):
        return "timed out"
    if isinstance(error, OutOfMemory):
        return "out of memory"
    return "refused" if isinstance(error, ValueError) else "failed"


def _verdict(case: HardCase, gain: float, bound: float, residual: float, error: float, excused: float) -> str:
    if not gain <= bound:
        return "gains energy"
    if not residual <= RESTITUTION_TOLERANCE:
        return "restitution unmet"
    if case.well_posed and not error <= excused:
        return "wrong motion"
    return "stable"


def _near_tolerance(residual: float) -> bool:
    return RESTITUTION_TOLERANCE / _NOISE <= residual <= RESTITUTION_TOLERANCE * _NOISE


def _answer(case: HardCase, method: str) -> Answer:
    """One answer, and the median time of a few."""
    if len(case.contact_jacobian) >= _MANY_CONTACTS and method in _FORM_DELASSUS:
        return bounded_impact(case, method)
    warm_up()
    first = resolve_once(case, method)
    if first.seconds >= _SLOW:
        return first
    return first._replace(seconds=statistics.median(resolve_once(case, method).seconds for _ in range(_REPEATS)))


def resolve_once(case: HardCase, method: str) -> Answer:
    """Resolve and time one impact."""
    given = case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution
    if isinstance(case, FrictionalCase):
        return _resolve_friction(case, method)
    from iapb import resolve_impact

    options: dict[str, Any] = {"method": "factored", "clamp": False} if method == WITHOUT_CLAMP else {"method": method}
    started = time.perf_counter()
    impact = resolve_impact(*given, **options)
    return Answer(impact.velocity, impact.rank, impact.clamp, time.perf_counter() - started)


def _resolve_friction(case: FrictionalCase, method: str) -> Answer:
    """The engine's law with friction, or Newton's and Coulomb's laws as they stand."""
    from iapb.contact.impact_laws import resolve_frictional_impact

    started = time.perf_counter()
    if method == NEWTON_COULOMB:
        v_plus, clamp = np.array([float(x) for x in case.newton_with_coulomb()]), np.nan
    else:
        found = resolve_frictional_impact(
            case.mass_matrix, case.contact_jacobian, case.tangent, case.velocity, float(case.restitution), case.friction
        )
        v_plus, clamp = found.velocity, found.clamp
    return Answer(v_plus, 1, clamp, time.perf_counter() - started)


@cache
def warm_up() -> None:
    """Compile before any clock runs."""
    from iapb import resolve_impact

    resolve_impact([[1.0]], [[1.0]], [-1.0], 0.5)
    resolve_impact(np.eye(2), np.eye(2), [-1.0, -1.0], [0.5, 0.25])


def _unmet(case: HardCase, v_plus: Floats) -> float:
    """Largest relative violation of the law on the rows as given; speeds are scaled first, so nothing underflows."""
    unit = float(np.max(np.abs(case.velocity), initial=0.0)) or 1.0
    J, v, after = case.contact_jacobian, case.velocity / unit, v_plus / unit
    lower = np.linalg.cholesky(case.mass_matrix)
    scale = np.linalg.norm(np.linalg.solve(lower, J.T), axis=0) * np.linalg.norm(lower.T @ v)
    if np.ndim(case.restitution):
        unmet = np.maximum(-(J @ after), 0.0)  # Poisson's law: nothing approaches afterwards
    else:
        unmet = np.abs(J @ after + case.restitution * (J @ v))
    return float(np.max(np.divide(unmet, scale, out=np.zeros(len(J)), where=scale > 0.0), initial=0.0))


def _forward_error(case: HardCase, v_plus: Floats) -> float:
    """|v⁺ − truth| / |v⁻| in the kinetic metric, exactly up to the last root."""
    error = [Fraction(x) - t for x, t in zip(v_plus, case.truth.velocity, strict=True)]
    before = [Fraction(x) for x in case.velocity]
    return float(np.sqrt(float(_form(case, error) / _form(case, before))))


def _rounding_of_small_numbers(case: HardCase) -> float:
    """Share of |v⁻| that rounding every component to the grid of subnormals can be."""
    diagonal = sum((Fraction(x) for x in np.diag(case.mass_matrix)), Fraction(0)) * _HALF_SUBNORMAL**2
    energy = _form(case, [Fraction(x) for x in case.velocity])
    return float(np.sqrt(float(len(case.velocity) * diagonal / energy)))


def _form(case: HardCase, x: list[Fraction]) -> Fraction:
    """xᵀ M x."""
    M, d = case.mass_matrix, len(x)
    return sum((x[i] * Fraction(M[i, j]) * x[j] for i in range(d) for j in range(d)), Fraction(0))

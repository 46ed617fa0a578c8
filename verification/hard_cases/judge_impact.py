"""Judge an impact method on a hard case by its energy gain, restitution residual and distance from the exact outcome.

A method that forms the Delassus matrix of thousands of contacts takes minutes and gigabytes, and Python cannot
interrupt a C routine. Such a call therefore runs in its own process. Its time starts when the process has compiled the
kernels. A call beyond the time limit is killed and reported as timed out.
"""

from __future__ import annotations

import os
import pickle
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from fractions import Fraction
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from iapb import resolve_frictional_impact, resolve_impact
from iapb.errors import IapbError, RangeError
from reference.exact import relative_energy_gain
from reference.one_thread import one_thread
from verification.hard_cases.case import (
    DEPENDS_ON_ROUNDING,
    EPS,
    NEWTON_COULOMB,
    RESTITUTION_TOLERANCE,
    Floats,
    FrictionalCase,
    HardCase,
    HardCaseVerdict,
    smallest_fault,
)
from verification.hard_cases.exact import dot, fractions
from verification.methods import COMPARED

WITHOUT_CLAMP = "factored, no clamp"
METHODS = ("factored", WITHOUT_CLAMP, *COMPARED)
# Factor of n ε √κ (√κ + κ(A)), n = max(c, d). The backward error of Cholesky's factor, the two solves with this factor
# (Higham 2002, theorems 10.3 and 8.5) and the basis of the rows each contribute a few n ε; 1 + e = 2 doubles them. κ is
# that of M scaled to a unit diagonal, because rounding acts on each component by itself (van der Sluis 1969).
_MARGIN = 10.0
_REPEATS = 5  # number of timed calls after the first one, which fills caches; their median is reported
_SLOW = 0.2  # [s] a slower call is not repeated
_HALF_SUBNORMAL = Fraction(1, 2**1075)  # rounding error of subnormal numbers, which no relative bound covers
_FORM_DELASSUS = ("gram_pinv", "gram_cholesky", "damped")
# The residuals of these methods depend on the LAPACK: 7e-9 to 5e-8 on Kahan's rows, with a tolerance of 1e-8.
_THROUGH_LAPACK = ("gram_pinv", "gram_cholesky", "svd")
_NOISE = 10.0  # a residual within this factor of the tolerance decides nothing
# An error of more than half of |v⁻| is entirely noise, and the sign of the energy gain is then random (relative gains
# of −1e-3 to 1e-4, depending on the BLAS, for the printed formula on rows 1e-4 apart).
_ALL_NOISE = 0.5
_MANY_CONTACTS = 2000  # from here on these methods run in their own process: the SVD of W takes a second

LIMIT_SECONDS = 2.0  # [s] two thousand haptic steps; a slower method is of no use for haptics
LIMIT_BYTES = 6 << 30  # address space: seven matrices of 10,000 x 10,000 doubles and the libraries
_READY = b"ready\n"


class TimedOut(IapbError):
    """A call exceeded its time limit."""


class OutOfMemory(IapbError):
    """A call exceeded its memory limit."""


class Answer(NamedTuple):
    """The judged quantities of an impact, v⁺, rank (None: not known) and clamp, and the time of the call [s]."""

    velocity: Any
    rank: int | None
    clamp: float
    seconds: float


class Found(NamedTuple):
    """The three measures of an answer; each is compared with its bound."""

    gain: float
    residual: float
    distance: float


def judge_impact(case: HardCase, method: str) -> HardCaseVerdict:
    """Return the verdict of one method on one impact."""
    truth = case.truth
    energy_bound = 10.0 * len(case.velocity) * EPS * float(np.sqrt(truth.condition))
    forward_bound = allowed_error(case)
    try:
        answer = _answer(case, method)
    except IapbError as error:
        return HardCaseVerdict(case.name, method, _word(error), str(error), energy_bound=energy_bound,
                               forward_bound=forward_bound, exact_rank=truth.rank)  # fmt: skip
    word = partial(_verdict, case, energy_bound, forward_bound)
    found = _found(case, answer.velocity)
    verdict, fault = word(found), np.nan
    undecided = verdict != "gains energy" and _near_tolerance(found.residual)
    noise = verdict in ("gains energy", "restitution unmet") and found.distance > _ALL_NOISE
    if method in _THROUGH_LAPACK and (undecided or noise):
        verdict = DEPENDS_ON_ROUNDING
    if verdict == "stable":
        fault = max(smallest_fault(partial(_is_seen, case, word, answer.velocity, wrong))
                    for wrong in faulty_answers(case, answer.velocity))  # fmt: skip
    return HardCaseVerdict(
        case.name, method, verdict, "", found.gain, energy_bound, found.residual, found.distance, forward_bound,
        answer.rank, truth.rank, answer.clamp, answer.seconds, fault,
    )  # fmt: skip


def allowed_error(case: HardCase) -> float:
    """Return the largest error of v⁺ by rounding, in the kinetic metric, relative to |v⁻|."""
    truth, n = case.truth, max(case.contact_jacobian.shape)
    root = float(np.sqrt(truth.scaled_condition))
    return _MARGIN * n * EPS * root * (root + truth.row_condition) + _rounding_of_small_numbers(case)


def _found(case: HardCase, v_plus: Floats) -> Found:
    gain = relative_energy_gain(case.mass_matrix, case.velocity, v_plus)
    return Found(gain, _unmet(case, v_plus), _forward_error(case, v_plus))


def faulty_answers(case: HardCase, v_plus: Floats) -> list[Floats]:
    """Return the vectors that a relative fault scales: the change of velocity, and v⁺ unless it is nearly zero."""
    change = v_plus - case.velocity
    stopped = _form(case, v_plus) <= _form(case, case.velocity) / 10**6
    return ([change] if change.any() else []) + ([] if stopped else [v_plus])


def _is_seen(case: HardCase, word: Callable[[Found], str], answer: Floats, wrong: Floats, fault: float) -> bool:
    """Return whether a fault of this size changes the verdict from "stable"."""
    return word(_found(case, answer + fault * wrong)) != "stable"


def _word(error: IapbError) -> str:
    """Return the verdict for an error."""
    if isinstance(error, TimedOut):
        return "timed out"
    if isinstance(error, OutOfMemory):
        return "out of memory"
    return "refused" if isinstance(error, ValueError) else "failed"


def _verdict(case: HardCase, bound: float, excused: float, found: Found) -> str:
    if not found.gain <= bound:
        return "gains energy"
    if not found.residual <= RESTITUTION_TOLERANCE:
        return "restitution unmet"
    if case.well_posed and not found.distance <= excused:
        return "wrong motion"
    return "stable"


def _near_tolerance(residual: float) -> bool:
    return RESTITUTION_TOLERANCE / _NOISE <= residual <= RESTITUTION_TOLERANCE * _NOISE


def _answer(case: HardCase, method: str) -> Answer:
    """Return an answer with the median time of a few calls."""
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

    started = time.perf_counter()
    if method in COMPARED:
        velocity = COMPARED[method](*given)
        seconds = time.perf_counter() - started
        if not np.isfinite(velocity).all():
            raise RangeError("velocity", f"{method} works on the numbers as given")
        return Answer(velocity, None, np.nan, seconds)
    impact = resolve_impact(*given, clamp=None if method == "factored" else False)
    return Answer(impact.velocity, impact.rank, impact.clamp, time.perf_counter() - started)


def _resolve_friction(case: FrictionalCase, method: str) -> Answer:
    """Resolve by the engine's law with friction, or by Newton's and Coulomb's laws without its reduction."""
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
    """Compile the kernels before the timed calls."""
    resolve_impact([[1.0]], [[1.0]], [-1.0], 0.5)
    resolve_impact(np.eye(2), np.eye(2), [-1.0, -1.0], [0.5, 0.25])


def _unmet(case: HardCase, v_plus: Floats) -> float:
    """Return the largest relative violation of the law on the given rows; scaled speeds prevent underflow."""
    unit = float(np.max(np.abs(case.velocity), initial=0.0)) or 1.0
    J, v, after = case.contact_jacobian, case.velocity / unit, v_plus / unit
    lower = np.linalg.cholesky(case.mass_matrix)
    scale = np.linalg.norm(np.linalg.solve(lower, J.T), axis=0) * np.linalg.norm(lower.T @ v)
    if np.ndim(case.restitution):
        unmet = np.maximum(-(J @ after), 0.0)  # Poisson's law: no contact approaches after the impact
    else:
        unmet = np.abs(J @ after + case.restitution * (J @ v))
    return float(np.max(np.divide(unmet, scale, out=np.zeros(len(J)), where=scale > 0.0), initial=0.0))


def _forward_error(case: HardCase, v_plus: Floats) -> float:
    """Return |v⁺ − truth| / |v⁻| in the kinetic metric; only the final root is rounded."""
    error = [Fraction(x) - t for x, t in zip(v_plus, case.truth.velocity, strict=True)]
    return float(np.sqrt(float(_form(case, error) / _form(case, case.velocity))))


def _rounding_of_small_numbers(case: HardCase) -> float:
    """Return the largest error of v⁺, relative to |v⁻|, from rounding its components to subnormal numbers."""
    diagonal = sum((Fraction(x) for x in np.diag(case.mass_matrix)), Fraction(0)) * _HALF_SUBNORMAL**2
    return float(np.sqrt(float(len(case.velocity) * diagonal / _form(case, case.velocity))))


def _form(case: HardCase, vector: Any) -> Fraction:
    """Return xᵀ M x exactly."""
    x, M = fractions(vector), case.mass_matrix
    return dot(x, [dot(row, x) for row in fractions(M)])


def bounded_impact(
    case: HardCase, method: str, limit: float = LIMIT_SECONDS, most_bytes: int = LIMIT_BYTES
) -> Answer:
    """Resolve one hard case by one method in a separate process.

    Raises
    ------
    TimedOut, OutOfMemory
        The call exceeds `limit` [s] or `most_bytes` of address space (checked on POSIX systems only).
    IapbError
        The resolver raised an error, or the process failed.
    """
    paths = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}  # the separate process imports the same packages
    threads = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}  # each thread's buffers count as address space
    environment = {**os.environ, **paths, **threads}
    command = [sys.executable, "-c", f"from {__name__} import serve; serve()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment) as process:
        if process.stdout is None or process.stdout.readline() != _READY:
            raise IapbError("the process for a bounded call did not start")
        try:
            out, _ = process.communicate(pickle.dumps((case, method, most_bytes)), timeout=limit)
        except subprocess.TimeoutExpired:
            process.kill()
            raise TimedOut(f"cut after {limit:g} s") from None
    if process.returncode != 0:
        raise IapbError(f"the process for a bounded call ended with code {process.returncode}")
    found = pickle.loads(out)
    if isinstance(found, Exception):
        raise found
    answer: Answer = found
    return answer


def serve() -> None:
    """Run the separate process: compile, report that it is ready, read one call and write its answer."""
    with one_thread():
        warm_up()
        sys.stdout.buffer.write(_READY)
        sys.stdout.buffer.flush()
        case, method, most_bytes = pickle.loads(sys.stdin.buffer.read())
        _limit_memory(most_bytes)
        try:
            found: Any = resolve_once(case, method)
        except MemoryError:
            found = OutOfMemory(f"needs more than {most_bytes / 2**30:g} GiB")
        except IapbError as error:
            found = IapbError(str(error))
    sys.stdout.buffer.write(pickle.dumps(found))


def _limit_memory(most_bytes: int) -> None:
    try:
        import resource
    except ImportError:  # not a POSIX system: only the time is limited
        return
    resource.setrlimit(resource.RLIMIT_AS, (most_bytes, most_bytes))

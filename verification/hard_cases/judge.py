"""Judge methods and worlds on hard cases; each pair of case and method gets one verdict with its
numbers.

An impact method is judged by its energy gain, restitution residual and distance from the exact
outcome. A world must create no energy, and its error may not exceed the error that its time step
may cause.

A method that forms the Delassus matrix of thousands of contacts takes minutes and gigabytes, and
Python cannot interrupt a C routine. Such a method is not tried on more than MOST_CONTACTS contacts,
and its row says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from iapb import resolve_frictional_impact, resolve_impact
from iapb.errors import IapbError, RangeError
from iapb.run import Run
from iapb.scene import Scene, scene_from_text
from iapb.scene.mechanism import mechanism_of
from reference.exact import fractions_of, rational_matrix, relative_energy_gain
from reference.worlds import run_world
from verification.hard_cases.case import (
    DEPENDS_ON_ROUNDING,
    NEWTON_COULOMB,
    NOT_TRIED,
    RESTITUTION_TOLERANCE,
    STABLE,
    AnyCase,
    Floats,
    FrictionalCase,
    HardCase,
    TrajectoryCase,
    largest_gain,
    smallest_fault,
)
from verification.impacts import EPS, ImpactCase
from verification.methods import COMPARED
from verification.table import Row

Simulate = Callable[[Scene, str], Run]

_STILL = 1e-9  # [m, rad] largest displacement by rounding and by settling springs
WITHOUT_CLAMP = "factored, no clamp"
METHODS = ("factored", WITHOUT_CLAMP, *COMPARED)
# Factor of n ε √κ (√κ + κ(A)), n = max(c, d). The backward error of Cholesky's factor, the two
# solves with this factor (Higham 2002, theorems 10.3 and 8.5) and the basis of the rows each
# contribute a few n ε; 1 + e = 2 doubles them. κ is that of M scaled to a unit diagonal, because
# rounding acts on each component by itself (van der Sluis 1969).
_MARGIN = 10.0
# rounding error of subnormal numbers, which no relative bound covers
_HALF_SUBNORMAL = Fraction(1, 2**1075)
_FORM_DELASSUS = ("gram_pinv", "gram_cholesky", "damped")
# The residuals of these methods depend on the LAPACK: 7e-9 to 5e-8 on Kahan's rows, with a
# tolerance of 1e-8.
_THROUGH_LAPACK = ("gram_pinv", "gram_cholesky", "damped", "svd")
_NOISE = 10.0  # a residual within this factor of the tolerance decides nothing
# An error of more than half of |v⁻| is entirely noise, and the sign of the energy gain is then
# random (relative gains of −1e-3 to 1e-4, depending on the BLAS, for the printed formula on rows
# 1e-4 apart).
_ALL_NOISE = 0.5
MOST_CONTACTS = 2000  # on which these methods are tried: the SVD of W takes a second


def methods_for(case: AnyCase) -> tuple[str, ...]:
    """Return the impact methods or the worlds that are judged on a case."""
    if isinstance(case, HardCase):
        return METHODS if case.methods is None else case.methods
    return case.worlds


# The numbers of a verdict in a row; a number that does not apply, or is missing or not finite, is
# None.
_NUMBERS = (
    "energy gain",  # impacts: the exact (KE⁺ − KE⁻)/KE⁻; motions: see `largest_gain`
    "gain allowed",  # by rounding (10 d ε √κ(M)) or by the time step
    # max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|); Poisson's law: the largest approach left; motions: see
    # `restitution_residual`
    "restitution residual",
    # impacts: |v⁺ − truth| / |v⁻| in the kinetic metric; motions: relative distance from the law
    "forward error",
    "error allowed",  # by the conditioning or the time step
    # the smallest relative fault in a stable answer that changes the verdict
    "smallest fault seen",
)


def judge_hard_case(case: AnyCase, method: str, simulate: Simulate = run_world) -> Row:
    """Return the row of one method on one impact, or of one world on one trajectory.

    The outcome is "stable", "gains energy", "restitution unmet", "wrong motion", "refused",
    "failed", NOT_TRIED or DEPENDS_ON_ROUNDING. The last one is for methods that use LAPACK: their
    residual is within a factor of ten of the tolerance, or their error exceeds half of |v⁻|, so
    another BLAS may change the outcome. The rank is the one that the method used, or the largest of
    a run's impacts.
    """
    return (
        judge_impact(case, method)
        if isinstance(case, HardCase)
        else _judge_motion(case, method, simulate)
    )


def _judge_motion(case: TrajectoryCase, world: str, simulate: Simulate) -> Row:
    """Return the row of one world on one motion."""
    try:
        run = simulate(case.scene, world)
    except IapbError as error:
        return _row(world, _verdict_of(error), note=str(error))
    found = case.measure(run)
    residual = restitution_residual(run)
    restored = not residual > RESTITUTION_TOLERANCE  # NaN: the run has no collision to judge
    gain = largest_gain(run) if found.gain is None else found.gain
    verdict = _verdict(gain <= found.gain_allowed, restored, found.error <= found.error_allowed)

    def is_seen(size: float) -> bool:  # a planted fault does not change the energies
        moved = case.measure(faulty_motion(run, size))
        return not moved.error <= moved.error_allowed

    fault = smallest_fault(is_seen) if verdict == STABLE else math.nan
    numbers = gain, found.gain_allowed, residual, found.error, found.error_allowed, fault
    return _row(world, verdict, numbers, int(run.impacts.rank.max(initial=0)))


def _row(
    method: str,
    outcome: str,
    numbers: Sequence[float] = (math.nan,) * len(_NUMBERS),
    rank: int | None = None,
    exact_rank: int | None = None,
    note: str = "",
) -> Row:
    known = {
        name: x if math.isfinite(x) else None for name, x in zip(_NUMBERS, numbers, strict=True)
    }
    return {
        "method": method,
        "outcome": outcome,
        **known,
        "rank": rank,
        "exact rank": exact_rank,
        "note": note,
    }


def _verdict(passive: bool, restored: bool, right: bool) -> str:
    if not (passive and restored):
        return "restitution unmet" if passive else "gains energy"
    return STABLE if right else "wrong motion"


def _verdict_of(error: IapbError) -> str:
    return "refused" if isinstance(error, ValueError) else "failed"


def faulty_motion(run: Run, fault: float) -> Run:
    """Return the run with all displacements and changes of velocity increased by the share `fault`.

    If nothing moves in the run, all coordinates creep instead at this share of the scene's
    v_threshold.
    """
    moved = run.q - run.q[0]
    sped = run.v - run.v[0]
    if np.abs(moved).max() < _STILL:
        creep = run.scene_resolved["contact"]["friction_velocity"]
        moved = creep * run.time[:, None] * np.ones_like(moved)
        sped = creep * np.ones_like(sped)
    return replace(run, q=run.q + fault * moved, v=run.v + fault * sped)


def restitution_residual(run: Run) -> float:
    """Return the largest |p·γ⁺ + e p·γ⁻| / p·(γ⁺ − γ⁻) of all steps with collisions; NaN if there
    is none to judge.

    p are the normal impulses of the step's contacts, γ⁻ and γ⁺ their normal velocities before and
    after the impact. If every contact that pushes satisfies γ⁺ = −e γ⁻, the residual is zero. For a
    rigid world the result is NaN, because its impulses also close gaps and carry the forces of the
    step.
    """
    contacts = run.contacts
    impacts = run.impacts
    struck = np.flatnonzero(contacts.impulse)
    if run.law == "rigid constraints" or not len(struck):
        return math.nan
    step = np.repeat(np.arange(run.steps), np.diff(contacts.offsets))[struck]
    first = np.searchsorted(impacts.step, step)
    last = np.searchsorted(impacts.step, step, side="right") - 1
    at_once = impacts.time[first] == impacts.time[last]  # contacts show one moment of a step
    struck = struck[at_once]
    step = step[at_once]
    first = first[at_once]
    last = last[at_once]
    mechanism = mechanism_of(scene_from_text(run.scene_source))
    q = impacts.q[first]
    point = contacts.point[struck]
    normal = contacts.normal[struck]
    rows = mechanism.rows_along(q, contacts.body_a[struck], point, normal)
    rows -= mechanism.rows_along(q, contacts.body_b[struck], point, normal)
    rows *= contacts.impulse[struck, None]
    v_minus = impacts.v_minus[first]
    v_plus = impacts.v_plus[last]
    before = np.bincount(step, np.einsum("kd,kd->k", rows, v_minus))
    after = np.bincount(step, np.einsum("kd,kd->k", rows, v_plus))
    judged = after - before > 0.0
    if not judged.any():
        return math.nan
    e = float(run.scene_resolved["contact"]["restitution"])
    return float(np.max(np.abs(after + e * before)[judged] / (after - before)[judged]))


class Answer(NamedTuple):
    """The judged quantities of an impact: v⁺ and rank (None: not known)."""

    velocity: Any
    rank: int | None


def judge_impact(case: HardCase, method: str) -> Row:
    """Return the row of one method on one impact."""
    truth = case.truth
    gain_allowed = 10.0 * len(case.velocity) * EPS * float(np.sqrt(truth.condition))
    error_allowed = allowed_error(case)
    known = math.nan, gain_allowed, math.nan, math.nan, error_allowed, math.nan
    if method in _FORM_DELASSUS and len(case.contact_jacobian) > MOST_CONTACTS:
        note = f"it forms the Delassus matrix; tried on at most {MOST_CONTACTS:,} contacts"
        return _row(method, NOT_TRIED, known, exact_rank=truth.rank, note=note)
    try:
        answer = resolve_once(case, method)
    except IapbError as error:
        return _row(method, _verdict_of(error), known, exact_rank=truth.rank, note=str(error))

    def measured(v_plus: Floats) -> tuple[str, float, float, float]:
        """Return the verdict, the energy gain, the restitution residual and the distance from the
        truth."""
        gain = relative_energy_gain(case.mass_matrix, case.velocity, v_plus)
        residual = _unmet(case, v_plus)
        distance = _forward_error(case, v_plus)
        right = not case.well_posed or distance <= error_allowed
        return (
            _verdict(gain <= gain_allowed, residual <= RESTITUTION_TOLERANCE, right),
            gain,
            residual,
            distance,
        )

    def is_seen(wrong: Floats, size: float) -> bool:
        return measured(answer.velocity + size * wrong)[0] != STABLE

    (verdict, gain, residual, distance) = measured(answer.velocity)
    fault = np.nan
    near = RESTITUTION_TOLERANCE / _NOISE <= residual <= RESTITUTION_TOLERANCE * _NOISE
    noise = verdict in ("gains energy", "restitution unmet") and distance > _ALL_NOISE
    if method in _THROUGH_LAPACK and (verdict != "gains energy" and near or noise):
        verdict = DEPENDS_ON_ROUNDING
    if verdict == STABLE:
        fault = max(
            smallest_fault(partial(is_seen, wrong))
            for wrong in faulty_answers(case, answer.velocity)
        )
    numbers = gain, gain_allowed, residual, distance, error_allowed, fault
    return _row(method, verdict, numbers, answer.rank, truth.rank)


def allowed_error(case: HardCase) -> float:
    """Return the largest error of v⁺ by rounding, in the kinetic metric, relative to |v⁻|."""
    truth = case.truth
    n = max(case.contact_jacobian.shape)
    root = float(np.sqrt(truth.scaled_condition))
    diagonal = (
        sum((Fraction(x) for x in np.diag(case.mass_matrix)), Fraction(0)) * _HALF_SUBNORMAL**2
    )
    of_subnormals = float(
        np.sqrt(float(len(case.velocity) * diagonal / _form(case, case.velocity)))
    )
    return _MARGIN * n * EPS * root * (root + truth.row_condition) + of_subnormals


def faulty_answers(case: HardCase, v_plus: Floats) -> list[Floats]:
    """Return the vectors that a relative fault scales: the change of velocity, and v⁺ unless it is
    nearly zero."""
    change = v_plus - case.velocity
    stopped = _form(case, v_plus) <= _form(case, case.velocity) / 10**6
    return ([change] if change.any() else []) + ([] if stopped else [v_plus])


def resolve_once(case: HardCase, method: str) -> Answer:
    """Resolve one impact; with friction by the engine's law, or by Newton's and Coulomb's
    laws alone."""
    given = case.mass_matrix, case.contact_jacobian, case.velocity, case.restitution
    rank: int | None = None
    if isinstance(case, FrictionalCase) and method == NEWTON_COULOMB:
        velocity = np.array([float(x) for x in case.impact.velocity(1)])
        rank = 1
    elif isinstance(case, FrictionalCase):
        rubbed = resolve_frictional_impact(
            *given[:2], case.tangent, case.velocity, float(given[3]), case.friction
        )
        velocity = rubbed.velocity
        rank = 1
    elif method in COMPARED:
        velocity = COMPARED[method](*given)
    else:
        impact = resolve_impact(*given, clamp=method == "factored")
        velocity = impact.velocity
        rank = impact.rank
    if method in COMPARED and not np.isfinite(velocity).all():
        raise RangeError("velocity", f"{method} works on the numbers as given")
    return Answer(velocity, rank)


def _unmet(case: HardCase, v_plus: Floats) -> float:
    """Return the largest relative violation of the law on the given rows; scaled speeds prevent
    underflow."""
    unit = float(np.max(np.abs(case.velocity), initial=0.0)) or 1.0
    impact = ImpactCase(case.mass_matrix, case.contact_jacobian, case.velocity / unit)
    after = case.contact_jacobian @ (v_plus / unit)
    if np.ndim(case.restitution):
        # Poisson's law: no contact approaches after the impact
        unmet = np.maximum(-after, 0.0)
    else:
        unmet = np.abs(after + case.restitution * (case.contact_jacobian @ impact.velocity))
    scale = np.linalg.norm(impact.rows, axis=1) * impact.speed
    moving = scale > 0.0
    return float(np.max(unmet[moving] / scale[moving], initial=0.0))


def _forward_error(case: HardCase, v_plus: Floats) -> float:
    """Return |v⁺ − truth| / |v⁻| in the kinetic metric; only the final root is rounded."""
    error = [Fraction(x) - t for x, t in zip(v_plus, case.truth.velocity, strict=True)]
    return float(np.sqrt(float(_form(case, error) / _form(case, case.velocity))))


def _form(case: HardCase, vector: Any) -> Fraction:
    """Return xᵀ M x exactly."""
    x = rational_matrix("vector", vector)
    return fractions_of(x.transpose() * rational_matrix("mass_matrix", case.mass_matrix) * x)[0]

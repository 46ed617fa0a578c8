"""Claims on single impacts: C01 to C06, C08 and C09. A row compares the errors of a batch with
their bound."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from iapb import resolve_impact
from reference.complementarity.laws import newton_lcp
from reference.complementarity.problem import ImpactProblem
from reference.exact import exact_impact, fractions_of, rational_matrix, relative_energy_gain
from reference.worlds import run_world
from verification.check import Check, Study
from verification.claims.conditions import START, Condition, start_conditions
from verification.claims.peg import place, trace
from verification.finding import BEYOND, FAILING, MISPRINT
from verification.impacts import (
    EPS,
    Family,
    Floats,
    ImpactCase,
    approaching,
    draw_of_rank,
    integer_impacts,
)
from verification.methods import gram_cholesky, gram_pinv
from verification.proofs.numbers import pseudo_inverse
from verification.table import Columns, Row


class Batch(NamedTuple):
    """Random impacts of one family at one restitution, and the seed with which they were drawn."""

    impacts: list[ImpactCase]
    family: Family
    restitution: float
    seed: int


class Measure(NamedTuple):
    """One part of a claim: the error of each impact of a batch, and the largest error allowed.

    Without a bound the batch is computed in rational arithmetic: a quarter as many impacts, with
    integers only, and no error is allowed.
    """

    errors: Callable[[Batch], Sequence[float]]
    bound: Callable[[Batch], float] | None = None


def each(
    error: Callable[[ImpactCase, Any], float], bound: Callable[[Batch], float] | None = None
) -> Measure:
    """Return the part whose error is that of each impact by itself, at the restitution of the
    batch: a double, or a fraction if no error is allowed."""
    number = float if bound else Fraction

    def errors(batch: Batch) -> list[float]:
        e = number(batch.restitution)
        return [error(case, e) for case in batch.impacts]

    return Measure(errors, bound)


def batches(
    key: str,
    question: str,
    *,
    families: Sequence[Family],
    restitutions: Sequence[float],
    impacts: Mapping[str, int],
    parts: Mapping[str, Measure],
    exact: tuple[Sequence[Family], Sequence[float]] = ((), ()),
    draw: Callable[[Family, int, int], Iterator[ImpactCase]] = draw_of_rank,
    holds: Callable[[Row], bool | None] | None = None,
    **more: Any,
) -> Check:
    """Return a claim on batches of random impacts; each impact is a trial.

    impacts : number of impacts in one batch, by depth; exact : families and e of the parts in
        rational arithmetic; more : as in Check
    """
    plain, rational = (
        [part for part in parts if (parts[part].bound is None) is kind] for kind in (False, True)
    )
    cases = [*product(families, restitutions, plain), *product(*exact, rational)]

    def row(study: Study, case: tuple[Family, float, str]) -> Row:
        (family, e, part) = case
        count = impacts[study.depth]
        errors, bound = parts[part]
        if bound is None:
            count = max(count // 4, LEAST_EXACT)
        drawn = (draw if bound else integer_impacts)(family, count, study.seed)
        batch = Batch(list(drawn), family, e, study.seed)
        found = finite(errors(batch))
        limit = bound(batch) if bound else 0.0
        return {
            "part": part,
            "coordinates": family.coordinates,
            "contacts": family.contacts,
            "condition number": family.condition_number if bound else None,
            "restitution": e,
            "impacts": len(found),
            FAILING: int(np.sum(found > limit)),
            "error": float(found.max(initial=0.0)),
            "bound": limit,
        }

    return Check(
        key=key,
        question=question,
        cases=lambda study: cases,
        row=row,
        holds=holds or within_bound,
        columns=Columns(
            parts=("part",),
            counts=("impacts",),
            conditions=("coordinates", "contacts", "condition number", "restitution"),
        ),
        **more,
    )


LEAST_EXACT = 4  # impacts of a batch in rationals, so that three batches have at least ten


def finite(values: Iterable[float]) -> Floats:
    """Return the values as an array, with infinity in place of what is not a number."""
    array = np.fromiter(values, np.float64)
    return np.where(np.isnan(array), np.inf, array)


def within_bound(row: Row) -> bool | None:
    """Return whether the largest error of a batch is at most its bound."""
    return bool(row["error"] <= row["bound"])


def energy_bound(batch: Batch) -> float:
    """Relative energy gain that rounding alone may cause: 10 d ε √κ(M), the bound that the resolver
    documents."""
    return 10.0 * batch.family.coordinates * EPS * float(np.sqrt(batch.family.condition_number))


def solve_bound(batch: Batch) -> float:
    """Relative error allowed for quantities computed with one solve with M or with W: 100 d ε
    κ(M)."""
    return 100.0 * batch.family.coordinates * EPS * batch.family.condition_number


def kinetic_energy(mass_matrix: Floats, velocity: Floats) -> float:
    """½ vᵀ M v [J]."""
    return 0.5 * float(velocity @ mass_matrix @ velocity)


def energy_gain(case: ImpactCase, e: float) -> float:
    """Relative energy gain of an impact, in whole numbers."""
    after = resolve_impact(*case.arrays, e).velocity
    return relative_energy_gain(case.mass_matrix, case.velocity, after)


def exact_change(case: ImpactCase, e: Fraction) -> float:
    """Return the change of energy of an impact in rational arithmetic [J]."""
    impact = exact_impact(*case.arrays, e)
    return float(impact.energy_after - impact.energy_before)


NEVER_GAINS = each(exact_change)  # the theorem: no rounding


# C01, C02: the energy lost against the quadratic form of (18) and (24)

PASSIVE = "kinetic energy does not rise"
EXACTLY_PASSIVE = "kinetic energy does not rise, in rationals"
WITH_HALF = "loss is ½(1 − e²) vᵀJᵀW†Jv"
AS_PRINTED = "loss is (1 − e²) vᵀJᵀW†Jv"
EXACT_LOSS = "loss is ½(1 − e²) vᵀJᵀW†Jv, in rationals"


def losses(
    key: str, question: str, proof: str, families: Sequence[Family], impacts: Mapping[str, int]
) -> Check:
    """Return the claim that the loss equals the quadratic form: as printed, and with the factor ½
    missing in print."""
    first = families[0].condition_number
    return batches(
        key,
        question,
        families=families,
        restitutions=(0.0, 0.5, 0.9, 1.0),
        impacts=impacts,
        parts={
            PASSIVE: each(energy_gain, energy_bound),
            WITH_HALF: each(partial(_misfit, factor=0.5), solve_bound),
            AS_PRINTED: each(partial(_misfit, factor=1.0), solve_bound),
            EXACTLY_PASSIVE: NEVER_GAINS,
            EXACT_LOSS: each(_exact_misfit),
        },
        exact=([family for family in families if family.condition_number == first], (0.5,)),
        roles={AS_PRINTED: MISPRINT, PASSIVE: proof},
        draw=_halved,
        holds=_loss_holds,
    )


def _loss_holds(row: Row) -> bool | None:
    """Return whether a batch is within its bound; None where both factors would be."""
    within = within_bound(row)
    apart = 0.5 * (1.0 - row["restitution"] ** 2)
    if within and row["part"] in (WITH_HALF, AS_PRINTED) and apart <= 10.0 * row["bound"]:
        return None
    return within


def _halved(family: Family, count: int, seed: int) -> Iterator[ImpactCase]:
    """Yield impacts as `draw_of_rank`, but with velocities of which an impact with e = 0 takes half
    of the energy."""
    for case in draw_of_rank(family, count, seed):
        taken = _taken(case)
        rest = case.velocity - _taken(case)
        share = kinetic_energy(case.mass_matrix, rest) / kinetic_energy(case.mass_matrix, taken)
        yield replace(case, velocity=rest + taken * np.sqrt(share)) if share > 1e-9 else case


def _misfit(case: ImpactCase, e: float, factor: float) -> float:
    """|loss − factor (1 − e²) vᵀJᵀW†Jv|, relative to this form, which is twice the energy of
    `_taken`."""
    mass = case.mass_matrix
    form = 2.0 * kinetic_energy(mass, _taken(case)) / kinetic_energy(mass, case.velocity)
    return abs(energy_gain(case, e) / form + factor * (1.0 - e**2))


def _taken(case: ImpactCase) -> Floats:
    """M⁻¹JᵀW⁻¹J v with the independent rows: the velocity that an impact with e = 0 takes."""
    rows = case.contact_jacobian[: case.rank]
    impulses = np.linalg.solve(_delassus(case), rows @ case.velocity)
    return np.asarray(np.linalg.solve(case.mass_matrix, rows.T @ impulses))


def _delassus(case: ImpactCase) -> Floats:
    """Return the Delassus matrix of the independent rows."""
    rows = case.contact_jacobian[: case.rank]
    return np.asarray(rows @ np.linalg.solve(case.mass_matrix, rows.T))


def _exact_misfit(case: ImpactCase, e: Fraction) -> float:
    """|loss − ½(1 − e²) vᵀJᵀW†Jv|, in rational arithmetic."""
    after = exact_impact(*case.arrays, e)
    plastic = exact_impact(*case.arrays, 0)
    # With e = 0, v⁺ = v − Pv, so vᵀM(v − v⁺) = vᵀMPv is the quadratic form, computed independently
    # of the loss at e.
    form = -sum(
        (Fraction(x) * p for x, p in zip(case.velocity, plastic.generalized_impulse, strict=True)),
        Fraction(0),
    )
    return float(abs(after.energy_before - after.energy_after - (1 - e * e) * form / 2))


C01 = losses(
    "C01",
    "One frictionless collision never increases kinetic energy; the loss is vᵀJᵀW†Jv times a function of e.",
    "theorem_1",
    [Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e2, 1e5, 1e8)],
    {"quick": 16, "full": 200},
)
C02 = losses(
    "C02",
    "Redundant simultaneous collisions never increase kinetic energy; the loss is that of C01.",
    "theorem_2",
    [
        Family(*size, k)
        for size in ((3, 4, 2), (3, 6, 3), (6, 20, 4), (12, 60, 8))
        for k in (1e2, 1e5)
    ],
    {"quick": 12, "full": 150},
)


# C03: all rows against independent rows

BASIS = "orthonormal basis, in doubles"
_ROWS = [Family(*size, k) for size in ((3, 4, 2), (3, 6, 3), (6, 12, 4)) for k in (1e1, 1e3, 1e5)]


def _rows_apart(method: Callable[[Floats, Floats, Floats, float], Floats]) -> Measure:
    """Distance |v⁺(all rows) − v⁺(independent rows)| in the kinetic metric, relative to |v⁻|."""

    def distance(case: ImpactCase, e: float) -> float:
        (mass, rows, velocity) = case.arrays
        everything = method(mass, rows, velocity, e)
        chosen = gram_cholesky(mass, rows[: case.rank], velocity, e)
        return case.distance(everything, chosen)

    def bound(batch: Batch) -> float:  # both methods solve with M and with W
        condition = max(
            batch.family.condition_number,
            *(np.linalg.cond(_delassus(case)) for case in batch.impacts),
        )
        return float(100.0 * batch.family.coordinates * EPS * condition)

    return each(distance, bound)


def _differing(velocities: Callable[[ImpactCase, Fraction], tuple[Any, Any]]) -> Measure:
    """1 for each impact in which two velocities in rational arithmetic are not identical."""

    def differs(case: ImpactCase, e: Fraction) -> float:
        one, other = velocities(case, e)
        return float(tuple(one) != tuple(other))

    return each(differs)


def _by_pseudo_inverse(case: ImpactCase, e: Fraction) -> tuple[Any, Any]:
    """Return v⁺ = v − (1+e) M⁻¹Jᵀ(J M⁻¹Jᵀ)†J v, the printed formula (21), and v⁺ from independent
    rows."""
    mass, rows, v, factor = (
        rational_matrix("impact", array) for array in (*case.arrays, np.array([1 + e]))
    )
    impulse = pseudo_inverse(rows * mass.solve(rows.transpose())) * (rows * v) * factor
    after = v - mass.solve(rows.transpose() * impulse)
    return fractions_of(after), exact_impact(*case.arrays, e).velocity


C03 = batches(
    "C03",
    "The pseudo-inverse gives the same state as first removing the redundant rows.",
    families=_ROWS,
    restitutions=(0.5,),
    impacts={"quick": 12, "full": 150},
    exact=(_ROWS[::3], (0.5,)),
    parts={
        "pseudo-inverse, in doubles": _rows_apart(gram_pinv),
        BASIS: _rows_apart(lambda *arrays: resolve_impact(*arrays).velocity),
        "pseudo-inverse, in rationals": _differing(_by_pseudo_inverse),
        "other independent rows, in rationals": _differing(
            lambda case, e: (
                exact_impact(
                    case.mass_matrix, case.contact_jacobian[::-1], case.velocity, e
                ).velocity,
                exact_impact(*case.arrays, e).velocity,
            )
        ),
    },
    roles={BASIS: BEYOND},
)


# C04: e = 1 conserves energy

_ELASTIC = [
    Family(*size, k)
    for size in ((1, 1, 1), (3, 1, 1), (3, 6, 3), (6, 12, 4), (12, 60, 8))
    for k in (1e1, 1e4, 1e8)
]


C04 = batches(
    "C04",
    "With e = 1 kinetic energy is conserved.",
    families=_ELASTIC,
    restitutions=(1.0,),
    impacts={"quick": 12, "full": 200},
    exact=(_ELASTIC[::3], (1.0,)),
    parts={
        "in doubles": each(lambda case, e: abs(energy_gain(case, e)), solve_bound),
        "in rationals": each(lambda case, e: abs(exact_change(case, e))),
    },
)


# C05: one contact against complementarity


def _from_lcp(solver: str) -> Measure:
    """Largest |p − p_LCP| / p_LCP, where p_LCP is the multiplier of Newton's LCP at one approaching
    contact."""

    def difference(case: ImpactCase, e: float) -> float:
        given = (*approaching(case).arrays, e)
        ours = resolve_impact(*given).impulses
        theirs = newton_lcp(ImpactProblem.from_impact(*given), solver).impulse
        return float(np.abs(ours - theirs)[0] / np.abs(theirs)[0])

    return each(difference, solve_bound)


C05 = batches(
    "C05",
    "At a single contact the impulse equals that of the complementarity formulation.",
    families=[Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e1, 1e3, 1e5)],
    restitutions=(0.0, 0.3, 1.0),
    impacts={"quick": 8, "full": 100},
    parts={f"LCP by {solver}": _from_lcp(solver) for solver in ("daqp", "lemke")},
)


# C06: other coordinates

MASS_CONDITION = 1e2  # κ(M); the condition number of a family is that of its change of coordinates
# From metres to millimetres, with radians kept, it is about 1e3.
_CHANGES = [Family(*size, k) for size in ((3, 1, 1), (3, 6, 3), (6, 12, 4)) for k in (1e0, 1e3)]


def _coordinates_apart(batch: Batch) -> list[float]:
    """Distance of two outcomes for q = T r: solved for q̇, and solved for ṙ and transformed
    back."""
    family = batch.family
    rng = np.random.default_rng([batch.seed, family.coordinates, family.contacts])
    changes = [
        random_change(rng, family.coordinates, family.condition_number) for _ in batch.impacts
    ]
    return [
        _distance(case, change, batch.restitution)
        for case, change in zip(batch.impacts, changes, strict=True)
    ]


def random_change(rng: np.random.Generator, size: int, condition_number: float) -> Floats:
    """Return an invertible (d, d) matrix of this condition number, neither symmetric nor
    orthogonal."""
    left, _ = np.linalg.qr(rng.standard_normal((size, size)))
    right, _ = np.linalg.qr(rng.standard_normal((size, size)))
    return (left * np.logspace(0.0, -np.log10(condition_number), size)) @ right


def _distance(case: ImpactCase, change: Floats, e: float) -> float:
    """|v⁺ − T w⁺| in the kinetic metric relative to |v⁻|, with M' = TᵀMT, J' = JT, w = T⁻¹v."""
    mass, rows, velocity = case.arrays
    here = resolve_impact(mass, rows, velocity, e).velocity
    new_mass = change.T @ mass @ change
    there = resolve_impact(
        0.5 * (new_mass + new_mass.T), rows @ change, np.linalg.solve(change, velocity), e
    )
    return case.distance(here, change @ there.velocity)


def _sheared(case: ImpactCase, e: Fraction) -> tuple[Any, Any]:
    mass, rows, velocity = case.arrays
    shear = np.eye(len(velocity)) + np.triu(np.ones_like(mass), 1)
    unshear = np.round(np.linalg.inv(shear))  # integers, because the determinant is 1
    there = exact_impact(shear.T @ mass @ shear, rows @ shear, unshear @ velocity, e).velocity
    return exact_impact(mass, rows, velocity, e).velocity, shear.astype(int).astype(
        object
    ) @ np.array(there)


C06 = batches(
    "C06",
    "The outcome of a collision does not depend on the coordinates chosen.",
    families=_CHANGES,
    restitutions=(0.0, 0.7),
    impacts={"quick": 12, "full": 150},
    exact=(_CHANGES[::2], (0.5,)),
    parts={
        "random change of coordinates, in doubles": Measure(
            _coordinates_apart,
            lambda batch: (
                100.0
                * batch.family.coordinates
                * EPS
                * MASS_CONDITION
                * batch.family.condition_number**2
            ),
        ),
        "shear by whole numbers, in rationals": _differing(_sheared),
    },
    draw=lambda family, *given: draw_of_rank(
        family._replace(condition_number=MASS_CONDITION), *given
    ),
)


# C08: passive for every e in [-1, 1], scaled and spread as well

RANDOM = "random impacts"
EXACT = "random impacts, in rationals"
RENDERED = {
    rendering: [
        f"{how} impacts of the peg, {what}" for what in ("energy gain", "error of restitution")
    ]
    for rendering, how in (("scale", "Scaled"), ("spread", "Spread"))
}
_SIZES = ((1, 1, 1), (3, 6, 3), (6, 20, 4), (12, 60, 8))
_RESTITUTIONS = (-1.0, -0.9, -0.5, 0.0, 0.5, 0.9, 1.0)
_PASSIVE = batches(
    "C08",
    "An impact is passive for every e in [-1, 1]; scaled or spread impulses act like another e in [-1, 1].",
    families=[Family(*size, k) for size in _SIZES for k in (1e2, 1e6)],
    restitutions=_RESTITUTIONS,
    impacts={"quick": 8, "full": 150},
    exact=([Family(*size, 1e2) for size in _SIZES], _RESTITUTIONS),
    parts={
        RANDOM: each(energy_gain, energy_bound),
        EXACT: NEVER_GAINS,
    },
    roles={RANDOM: "theorem_2"} | {parts[0]: "scaled_impulse" for parts in RENDERED.values()},
)


def _random_or_peg(study: Study, case: Any) -> Any:
    """Return the row of one batch of random impacts, or the rows of the impacts of one run."""
    if not isinstance(case[1], Condition):
        return _PASSIVE.row(study, case)
    rendering, start = case
    run = trace(study, start, "IAPB", rendering)
    gains = -run.energy_lost / run.kinetic_energy[run.impact_step]
    return [
        {
            "part": part,
            "restitution": 0.0,
            "impacts of a run": len(errors),
            "error": float(finite(errors).max(initial=0.0)),
            "bound": 100.0 * EPS,
        }
        for part, errors in zip(RENDERED[rendering], (gains, run.misfit), strict=True)
        if len(errors)
    ]


C08 = replace(
    _PASSIVE,
    row=_random_or_peg,
    cases=lambda study: [
        *_PASSIVE.cases(study),
        *product(RENDERED, start_conditions(study.depth)),
    ],
)


# C09: e = -1 is the penalty-based simulation

RESOLVER = "velocity after an impact with e = -1"
TRAJECTORY = "trajectory with e = -1"
ALMOST = "trajectory with e the next double above -1"
JUST_ABOVE = float(np.nextafter(-1.0, 0.0))
# An impulse of 1e-16 of its usual size moves the 2 kg peg by 1e-17 m; contacts may amplify this
# distance [m, rad].
SAME_TRAJECTORY = 1e-11


def _without_impulse(study: Study, case: Family | Condition) -> Iterator[Row]:
    """Yield the row of one batch; or the distances of two trajectories from that of PB."""
    if isinstance(case, Family):
        impacts = list(draw_of_rank(case, {"quick": 20, "full": 300}[study.depth], study.seed))
        moved = finite(
            float(np.abs(resolve_impact(*each.arrays, -1.0).velocity - each.velocity).max())
            for each in impacts
        )
        yield {
            "part": RESOLVER,
            "contacts": case.contacts,
            "impacts": len(impacts),
            FAILING: int(np.sum(moved > 0.0)),
            "error [m/s]": float(moved.max()),
        }
        return
    penalty = trace(study, case, "PB")
    scene = place(study, case)
    for part, e, bound in ((TRAJECTORY, -1.0, 0.0), (ALMOST, JUST_ABOVE, SAME_TRAJECTORY)):
        # scene files may not have a negative e
        contact = scene.contact.model_copy(update={"restitution": e})
        run = run_world(scene.model_copy(update={"contact": contact}), "IAPB", "full")
        x, y, turned = np.maximum(
            np.abs(run.device_q - penalty.device).max(0), np.abs(run.q - penalty.tool).max(0)
        )
        yield {
            "part": part,
            **case.row(),
            "impacts of a run": len(run.impacts.step),
            "apart [m]": float(max(x, y)),
            "turned apart [rad]": float(turned),
            "bound": bound,
        }


def _moves_nothing(row: Row) -> bool | None:
    """Return whether no impact changes a velocity, or the trajectories are within the bound."""
    if row["part"] == RESOLVER:
        return bool(row["error"] == 0.0)
    return bool(max(row["apart"], row["turned apart"]) <= row["bound"])


C09 = Check(
    key="C09",
    question="With e = -1 the simulation is the penalty-based simulation.",
    cases=lambda study: [
        Family(1, 1, 1, 1e0),
        Family(3, 6, 3, 1e2),
        Family(6, 20, 4, 1e4),
        Family(12, 60, 8, 1e8),
        *start_conditions(study.depth),
    ],
    row=_without_impulse,
    holds=_moves_nothing,
    columns=Columns(parts=("part",), counts=("impacts",), conditions=(*START, "contacts")),
    roles={ALMOST: BEYOND, RESOLVER: "scaled_impulse", TRAJECTORY: "scaled_impulse"},
)

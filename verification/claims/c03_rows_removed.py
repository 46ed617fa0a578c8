"""C03: the pseudo-inverse gives the same state as removing redundant rows first, (25) and (33)."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.exact import exact_impact
from verification.claims.algebraic import (
    EPSILON,
    Batch,
    Exact,
    Measure,
    algebraic_claim,
    kinetic_energy,
    summary,
    worst,
)
from verification.claims.exact_pseudo_inverse import pseudo_inverse_velocity
from verification.finding import Table
from verification.impacts import Family, Floats, ImpactCase
from verification.methods import gram_cholesky, gram_pinv

PRINTED = "pseudo-inverse, in doubles"
FACTORED = "orthonormal basis, in doubles"
EXACT = "pseudo-inverse, in rationals"
OTHER_ROWS = "other independent rows, in rationals"
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((3, 4, 2), (3, 6, 3), (6, 12, 4)) for k in (1e1, 1e3, 1e5)
)  # fmt: skip


def _bound(batch: Batch) -> float:
    """Return 100 d ε max(κ(M), κ(W)): both methods solve with M and with W, the Delassus matrix of independent rows."""
    condition = max(batch.family.condition_number, *(np.linalg.cond(_delassus(case)) for case in batch.impacts))
    return float(100.0 * batch.family.coordinates * EPSILON * condition)


def _delassus(case: ImpactCase) -> np.ndarray:
    rows = case.contact_jacobian[: case.rank]
    return np.asarray(rows @ np.linalg.solve(case.mass_matrix, rows.T))


def _worst_distance(batch: Batch, method: Callable[..., Floats]) -> float:
    return worst(_distance(case, batch.restitution, method) for case in batch.impacts)


def _factored(M: Floats, J: Floats, v: Floats, e: float) -> Floats:
    return resolve_impact(M, J, v, e).velocity


def _distance(instance: ImpactCase, e: float, method: Callable[..., Floats]) -> float:
    """|v⁺(all rows) − v⁺(independent rows)| in the kinetic metric, relative to |v⁻|."""
    (mass, rows, velocity), rank = instance.arrays, instance.rank
    everything, chosen = method(mass, rows, velocity, e), gram_cholesky(mass, rows[:rank], velocity, e)
    return float(np.sqrt(kinetic_energy(mass, everything - chosen) / kinetic_energy(mass, velocity)))


def _wrong_inverse(batch: Batch) -> float:
    """Number of impacts in which the pseudo-inverse in rational arithmetic gives another velocity."""
    e = Fraction(batch.restitution)
    return float(sum(pseudo_inverse_velocity(*case.arrays, e) != exact_impact(*case.arrays, e).velocity
                     for case in batch.impacts))  # fmt: skip


def _wrong_rows(batch: Batch) -> float:
    """Number of impacts in which the rows in reverse order give another velocity."""
    wrong, e = 0, Fraction(batch.restitution)
    for mass, rows, velocity in (case.arrays for case in batch.impacts):
        first = exact_impact(mass, rows, velocity, e).velocity
        wrong += exact_impact(mass, rows[::-1], velocity, e).velocity != first
    return float(wrong)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    return (
        f"Number of states that differ in rational arithmetic: {summary(table, EXACT)}; with another choice of "
        f"independent rows: {summary(table, OTHER_ROWS)}. Relative difference in doubles, printed formula: "
        f"{summary(table, PRINTED)}; factored form: {summary(table, FACTORED)}."
    )


CLAIM = algebraic_claim(
    id="C03",
    statement="The pseudo-inverse gives the same state as first removing the redundant rows.",
    place="Section V-B, equations (25) and (33)",
    quantity="Distance of the two outcomes in the kinetic metric, relative to the velocity before; in rational "
    "arithmetic the number of impacts whose outcomes are not identical.",
    tolerance="In doubles 100 d ε times the larger of κ(M) and κ(W), because both methods solve with these matrices (W "
    "is the Delassus matrix of the independent rows). In rational arithmetic zero.",
    families=FAMILIES,
    restitutions=(0.5,),
    impacts={"quick": 12, "full": 150},
    parts={
        PRINTED: Measure(partial(_worst_distance, method=gram_pinv), _bound),
        FACTORED: Measure(partial(_worst_distance, method=_factored), _bound),
    },
    exact=Exact(FAMILIES[::3], 0.5, {EXACT: _wrong_inverse, OTHER_ROWS: _wrong_rows}),
    finding=finding,
)

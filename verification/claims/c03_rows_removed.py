"""C03: the pseudo-inverse gives the same state as removing redundant rows first, (25) and (33)."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import COLUMNS, kinetic_energy, solve_bound, summary, within_bound, worst
from verification.claims.claim import Claim
from verification.claims.exact_pseudo_inverse import pseudo_inverse_velocity
from verification.finding import Table, table_of
from verification.impacts import Family, ImpactCase, draw_of_rank, whole_numbers

if TYPE_CHECKING:
    from verification.claims.study import Study

PRINTED = "pseudo-inverse, in doubles"
FACTORED = "orthonormal basis, in doubles"
EXACT = "pseudo-inverse, in rationals"
OTHER_ROWS = "other independent rows, in rationals"
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((3, 4, 2), (3, 6, 3), (6, 12, 4))
    for k in (1e1, 1e3, 1e5)
)
IMPACTS = {"quick": 12, "full": 150}
RESTITUTION = 0.5


def measure(study: Study) -> Table:
    """All rows by the pseudo-inverse against independent rows alone."""
    count = IMPACTS[study.depth]
    batches = study.each(FAMILIES, lambda family: _batches(family, count, study.seed))
    exact = study.each(FAMILIES[::3], lambda family: _exact_batches(family, count // 4, study.seed))
    return table_of(COLUMNS, [*batches, *exact])


def _batches(family: Family, count: int, seed: int) -> Iterator[dict[str, Any]]:
    instances = list(draw_of_rank(family, count, seed))
    bound = worst(_bound(instance, family.condition_number) for instance in instances)
    for part, method in ((PRINTED, "gram_pinv"), (FACTORED, "factored")):
        yield {**_names(family), "condition number": family.condition_number, "part": part, "impacts": count,
               "error": worst(_distance(instance, method) for instance in instances), "bound": bound}  # fmt: skip


def _bound(instance: ImpactCase, condition_number: float) -> float:
    """Both ways solve with M and, in effect, with W of the independent rows."""
    (mass, rows, velocity), rank = instance.arrays, instance.rank
    delassus = rows[:rank] @ np.linalg.solve(mass, rows[:rank].T)
    return solve_bound(len(velocity), max(condition_number, float(np.linalg.cond(delassus))))


def _distance(instance: ImpactCase, method: str) -> float:
    """|v⁺(all rows) − v⁺(independent rows)| in the kinetic metric, relative to |v⁻|."""
    (mass, rows, velocity), rank = instance.arrays, instance.rank
    everything = resolve_impact(mass, rows, velocity, RESTITUTION, method=method).velocity
    chosen = resolve_impact(mass, rows[:rank], velocity, RESTITUTION, method="gram_cholesky").velocity
    return float(np.sqrt(kinetic_energy(mass, everything - chosen) / kinetic_energy(mass, velocity)))


def _exact_batches(family: Family, count: int, seed: int) -> Iterator[dict[str, Any]]:
    from reference.exact import exact_impact

    e, wrong_inverse, wrong_rows = Fraction(RESTITUTION), 0, 0
    for mass, rows, velocity in (case.arrays for case in whole_numbers(family, count, seed)):
        first = exact_impact(mass, rows, velocity, e).velocity
        wrong_inverse += pseudo_inverse_velocity(mass, rows, velocity, e) != first
        wrong_rows += exact_impact(mass, rows[::-1], velocity, e).velocity != first
    common = {**_names(family), "impacts": count, "bound": 0.0}
    yield {**common, "part": EXACT, "error": float(wrong_inverse)}
    yield {**common, "part": OTHER_ROWS, "error": float(wrong_rows)}


def _names(family: Family) -> dict[str, Any]:
    return {"coordinates": family.coordinates, "contacts": family.contacts, "restitution": RESTITUTION}


def finding(table: Table) -> str:
    """One sentence."""
    return (
        f"Without rounding the states are equal, digit for digit: states that differ {summary(table, EXACT)}, and "
        f"whichever rows are kept {summary(table, OTHER_ROWS)}. In doubles the printed formula differs "
        f"{summary(table, PRINTED)}, the factored form {summary(table, FACTORED)}."
    )


CLAIM = Claim(
    id="C03",
    statement="The pseudo-inverse gives the same state as first removing the redundant rows.",
    place="Section V-B, equations (25) and (33)",
    quantity="Distance of the two outcomes in the kinetic metric, relative to the velocity before; in rationals the "
    "number of impacts whose outcomes are not identical.",
    tolerance="100 d ε times the larger of κ(M) and κ(W), W of the independent rows, in doubles: both ways solve with "
    "them. In rationals none may differ.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

"""C04: a perfectly elastic impact conserves kinetic energy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import COLUMNS, energy_gains, solve_bound, summary, within_bound, worst
from verification.claims.claim import Claim
from verification.finding import Table, table_of
from verification.impacts import Family, draw_of_rank, whole_numbers

if TYPE_CHECKING:
    from verification.claims.study import Study

DOUBLES = "in doubles"
EXACT = "in rationals"
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((1, 1, 1), (3, 1, 1), (3, 6, 3), (6, 12, 4), (12, 60, 8))
    for k in (1e1, 1e4, 1e8)
)
IMPACTS = {"quick": 12, "full": 200}


def measure(study: Study) -> Table:
    """e = 1 at one contact and at redundant ones."""
    count = IMPACTS[study.depth]
    batches = study.each(FAMILIES, lambda family: [_batch(family, count, study.seed)])
    exact = study.each(FAMILIES[::3], lambda family: [_exact_batch(family, count // 4, study.seed)])
    return table_of(COLUMNS, [*batches, *exact])


def _batch(family: Family, count: int, seed: int) -> dict[str, Any]:
    instances = list(draw_of_rank(family, count, seed))
    after = [resolve_impact(*instance.arrays, 1.0).velocity for instance in instances]
    return {**_names(family), "part": DOUBLES, "condition number": family.condition_number, "impacts": count,
            "error": worst(np.abs(energy_gains(instances, after))),
            "bound": solve_bound(family.coordinates, family.condition_number)}  # fmt: skip


def _exact_batch(family: Family, count: int, seed: int) -> dict[str, Any]:
    from reference.exact import exact_impact

    impacts = [exact_impact(*instance.arrays, 1) for instance in whole_numbers(family, count, seed)]
    error = worst(float(abs(i.energy_after - i.energy_before)) for i in impacts)
    return {**_names(family), "part": EXACT, "impacts": count, "error": error, "bound": 0.0}


def _names(family: Family) -> dict[str, Any]:
    return {"coordinates": family.coordinates, "contacts": family.contacts, "restitution": 1.0}


def finding(table: Table) -> str:
    """One sentence."""
    return (
        f"Relative change of energy {summary(table, DOUBLES)}; without rounding the change of energy [J] is "
        f"{summary(table, EXACT)}."
    )


CLAIM = Claim(
    id="C04",
    statement="With e = 1 kinetic energy is conserved.",
    place="Sections V-A and V-B",
    quantity="Worst relative change of kinetic energy, gains and losses alike.",
    tolerance="100 d ε κ(M) in doubles (the factorization of M decides what is lost, never gained); in rationals none.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

"""C06: the resolution does not depend on the choice of coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import (
    COLUMNS,
    Floats,
    kinetic_energy,
    solve_bound,
    summary,
    within_bound,
    worst,
)
from verification.claims.claim import Claim
from verification.finding import Table, table_of
from verification.impacts import Family, ImpactCase, draw_of_rank, whole_numbers

if TYPE_CHECKING:
    from verification.claims.study import Study

DOUBLES = "random change of coordinates, in doubles"
EXACT = "shear by whole numbers, in rationals"
MASS_CONDITION = 1e2
# condition numbers of the coordinate change: metres to millimetres beside radians is about 1e3
FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((3, 1, 1), (3, 6, 3), (6, 12, 4))
    for k in (1e0, 1e3)
)
RESTITUTIONS = (0.0, 0.7)
IMPACTS = {"quick": 12, "full": 150}


def measure(study: Study) -> Table:
    """q = T r: the impact solved for q̇, and solved for ṙ and brought back."""
    count = IMPACTS[study.depth]
    batches = study.each(FAMILIES, lambda family: _batches(family, count, study.seed))
    exact = study.each(FAMILIES[::2], lambda family: [_exact_batch(family, count // 4, study.seed)])
    return table_of(COLUMNS, [*batches, *exact])


def _batches(family: Family, count: int, seed: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng([seed, family.coordinates, family.contacts])
    instances = list(draw_of_rank(family._replace(condition_number=MASS_CONDITION), count, seed))
    changes = [random_change(rng, family.coordinates, family.condition_number) for _ in instances]
    bound = solve_bound(family.coordinates, MASS_CONDITION * family.condition_number**2)
    for e in RESTITUTIONS:
        pairs = zip(instances, changes, strict=True)
        yield {**_names(family), "condition number": family.condition_number, "part": DOUBLES,
               "restitution": e, "impacts": count, "bound": bound,
               "error": worst(_distance(instance, change, e) for instance, change in pairs)}  # fmt: skip


def random_change(rng: np.random.Generator, size: int, condition_number: float) -> Floats:
    """Return an invertible (d, d) matrix of this condition number, neither symmetric nor orthogonal."""
    left, _ = np.linalg.qr(rng.standard_normal((size, size)))
    right, _ = np.linalg.qr(rng.standard_normal((size, size)))
    return (left * np.logspace(0.0, -np.log10(condition_number), size)) @ right


def _distance(instance: ImpactCase, change: Floats, e: float) -> float:
    """|v⁺ − T w⁺| in the kinetic metric relative to |v⁻|, with M' = TᵀMT, J' = JT, w = T⁻¹v."""
    mass, rows, velocity = instance.arrays
    here = resolve_impact(mass, rows, velocity, e).velocity
    new_mass = change.T @ mass @ change
    there = resolve_impact(0.5 * (new_mass + new_mass.T), rows @ change, np.linalg.solve(change, velocity), e)
    back = change @ there.velocity
    return float(np.sqrt(kinetic_energy(mass, here - back) / kinetic_energy(mass, velocity)))


def _exact_batch(family: Family, count: int, seed: int) -> dict[str, Any]:
    from reference.exact import exact_impact

    different = 0
    for mass, rows, velocity in (case.arrays for case in whole_numbers(family, count, seed)):
        shear = np.eye(len(velocity)) + np.triu(np.ones_like(mass), 1)
        unshear = np.round(np.linalg.inv(shear))  # whole numbers, as the determinant is 1
        here = np.array(exact_impact(mass, rows, velocity, 0.5).velocity)
        there = exact_impact(shear.T @ mass @ shear, rows @ shear, unshear @ velocity, 0.5).velocity
        back = shear.astype(int).astype(object) @ np.array(there)
        different += bool(np.any(here != back))
    return {**_names(family), "part": EXACT, "restitution": 0.5, "impacts": count, "error": float(different),
            "bound": 0.0}  # fmt: skip


def _names(family: Family) -> dict[str, Any]:
    return {"coordinates": family.coordinates, "contacts": family.contacts}


def finding(table: Table) -> str:
    """One sentence."""
    return (
        f"Outcomes brought back to the first coordinates differ, relative to the velocity, {summary(table, DOUBLES)}; "
        f"without rounding the outcomes that differ are {summary(table, EXACT)}."
    )


CLAIM = Claim(
    id="C06",
    statement="The outcome of a collision does not depend on the coordinates chosen.",
    place="Section V-A",
    quantity="Distance in the kinetic metric between the outcome and the one computed in other coordinates and "
    "brought back; in rationals the number of outcomes that differ.",
    tolerance="100 d ε κ(M) κ(T)²: the new mass matrix TᵀMT is that much worse conditioned. In rationals none.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

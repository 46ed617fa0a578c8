"""C06: the resolution does not depend on the choice of coordinates."""

from __future__ import annotations

from collections.abc import Iterator

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
from verification.finding import Table
from verification.impacts import Family, Floats, ImpactCase, draw_of_rank

DOUBLES = "random change of coordinates, in doubles"
EXACT = "shear by whole numbers, in rationals"
MASS_CONDITION = 1e2
# Condition numbers of the change of coordinates. From metres to millimetres, with radians kept, it is about 1e3.
FAMILIES = tuple(
    Family(d, contacts, rank, k) for d, contacts, rank in ((3, 1, 1), (3, 6, 3), (6, 12, 4)) for k in (1e0, 1e3)
)


def _draw(family: Family, count: int, seed: int) -> Iterator[ImpactCase]:
    """Draw impacts with κ(M) = MASS_CONDITION; the family's condition number is that of the change of coordinates."""
    return draw_of_rank(family._replace(condition_number=MASS_CONDITION), count, seed)


def _bound(batch: Batch) -> float:
    return 100.0 * batch.family.coordinates * EPSILON * MASS_CONDITION * batch.family.condition_number**2


def _worst_distance(batch: Batch) -> float:
    """Largest distance of two outcomes for q = T r: solved for q̇, and solved for ṙ and transformed back."""
    family = batch.family
    rng = np.random.default_rng([batch.seed, family.coordinates, family.contacts])
    changes = [random_change(rng, family.coordinates, family.condition_number) for _ in batch.impacts]
    return worst(_distance(case, change, batch.restitution)
                 for case, change in zip(batch.impacts, changes, strict=True))  # fmt: skip


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


def _different(batch: Batch) -> float:
    """Number of outcomes that differ in rational arithmetic."""
    different, e = 0, batch.restitution
    for mass, rows, velocity in (case.arrays for case in batch.impacts):
        shear = np.eye(len(velocity)) + np.triu(np.ones_like(mass), 1)
        unshear = np.round(np.linalg.inv(shear))  # integers, because the determinant is 1
        here = np.array(exact_impact(mass, rows, velocity, e).velocity)
        there = exact_impact(shear.T @ mass @ shear, rows @ shear, unshear @ velocity, e).velocity
        back = shear.astype(int).astype(object) @ np.array(there)
        different += bool(np.any(here != back))
    return float(different)


def finding(table: Table) -> str:
    """Return the result in words, with numbers."""
    return (
        f"Relative difference of the outcomes after transforming back: {summary(table, DOUBLES)}. Number of outcomes "
        f"that differ in rational arithmetic: {summary(table, EXACT)}."
    )


CLAIM = algebraic_claim(
    id="C06",
    statement="The outcome of a collision does not depend on the coordinates chosen.",
    place="Section V-A",
    quantity="Distance in the kinetic metric between the outcome and the one computed in other coordinates and "
    "transformed back; in rational arithmetic the number of outcomes that differ.",
    tolerance="100 d ε κ(M) κ(T)², because the transformation T gives the mass matrix TᵀMT, worse conditioned by "
    "κ(T)². In rational arithmetic zero.",
    families=FAMILIES,
    restitutions=(0.0, 0.7),
    impacts={"quick": 12, "full": 150},
    parts={DOUBLES: Measure(_worst_distance, _bound)},
    exact=Exact(FAMILIES[::2], 0.5, {EXACT: _different}),
    draw=_draw,
    finding=finding,
)

"""What the algebraic claims share: batches of impacts, an error and a bound per batch, and when a batch holds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from verification.finding import Column, Row, Table
from verification.impacts import Floats, ImpactCase

EPSILON = float(np.finfo(np.float64).eps)

COLUMNS = (
    Column("part", part=True),
    Column("coordinates", condition=True),
    Column("contacts", condition=True),
    Column("condition number", condition=True),
    Column("restitution", condition=True),
    Column("impacts"),
    Column("error"),
    Column("bound"),
)


def within_bound(row: Row) -> bool | None:
    """A batch holds where its worst error is within its bound; an unknown error never is."""
    return bool(row["error"] <= row["bound"])


def energy_bound(instance_size: int, condition_number: float) -> float:
    """Relative energy gain that rounding alone may show: 10 d ε √κ(M), the resolver's promise."""
    return 10.0 * instance_size * EPSILON * float(np.sqrt(condition_number))


def solve_bound(instance_size: int, condition_number: float) -> float:
    """Relative error of quantities that go through one solve with M or through W: 100 d ε κ(M)."""
    return 100.0 * instance_size * EPSILON * condition_number


def kinetic_energy(mass_matrix: Floats, velocity: Floats) -> float:
    """½ vᵀ M v [J]."""
    return 0.5 * float(velocity @ mass_matrix @ velocity)


def energy_gains(instances: Sequence[ImpactCase], velocities: Sequence[Floats]) -> Floats:
    """Relative energy gain of each impact, in double-double arithmetic, plus the bound of its error."""
    from reference.exact import bulk_energy_gain

    masses = np.stack([instance.mass_matrix for instance in instances])
    before = np.stack([instance.velocity for instance in instances])
    gain, uncertainty = bulk_energy_gain(masses, before, np.stack(velocities))
    return gain + uncertainty


def quadratic_form(instance: ImpactCase) -> float:
    """vᵀ Jᵀ W† J v [J], W = J M⁻¹ Jᵀ, from the independent rows alone: the form of (18) and (24) without a factor."""
    rows = instance.contact_jacobian[: instance.rank]
    closing = rows @ instance.velocity
    delassus = rows @ np.linalg.solve(instance.mass_matrix, rows.T)
    return float(closing @ np.linalg.solve(delassus, closing))


def worst(values: Iterable[float]) -> float:
    """Largest of the values; infinite where one is not a number."""
    array = np.fromiter(values, np.float64)
    return float(np.max(np.where(np.isnan(array), np.inf, array), initial=0.0))


def summary(table: Table, part: str) -> str:
    """`worst error e (bound b) in n impacts` of one part of a claim."""
    rows = table.where(part=part).records()
    closest = max(rows, key=lambda row: row["error"] / row["bound"] if row["bound"] else row["error"])
    impacts = sum(row["impacts"] for row in rows)
    return f"at most {closest['error']:.1e} (allowed {closest['bound']:.1e}) in {impacts} impacts"

"""Parts shared by the algebraic claims: each trial compares the error of a batch of random impacts with a bound."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reference.exact import bulk_energy_gain
from verification.claims.claim import Claim
from verification.finding import Column, Row, Table
from verification.impacts import Family, Floats, ImpactCase, draw_of_rank, whole_numbers

if TYPE_CHECKING:
    from verification.claims.study import Study

EPSILON = float(np.finfo(np.float64).eps)

COLUMNS = (
    Column("part", part=True),
    Column("coordinates", condition=True),
    Column("contacts", condition=True),
    Column("condition number", condition=True),
    Column("restitution", condition=True),
    Column("impacts", cases=True),
    Column("error"),
    Column("bound"),
)


class Batch(NamedTuple):
    """Random impacts of one family at one restitution, and the seed with which they were drawn."""

    impacts: list[ImpactCase]
    family: Family
    restitution: float
    seed: int


class Measure(NamedTuple):
    """One part of an algebraic claim: the largest error of a batch, and the largest error allowed."""

    error: Callable[[Batch], float]
    bound: Callable[[Batch], float]


class Exact(NamedTuple):
    """Parts in rational arithmetic, which allow no error; a batch has a quarter as many impacts, with integers only."""

    families: Sequence[Family]
    restitution: float
    errors: Mapping[str, Callable[[Batch], float]]


def cases_of(
    families: Sequence[Family], restitutions: Sequence[float], parts: Iterable[str], exact: Exact | None = None
) -> list[tuple[str, Family, float]]:
    """Return (part, family, restitution) of every batch, the exact parts last."""
    plain = product(families, restitutions, parts)
    rational = product(exact.families, [exact.restitution], exact.errors) if exact else ()
    return [(part, family, e) for family, e, part in chain(plain, rational)]


def trial_of(
    study: Study, case: tuple[str, Family, float], count: int, parts: Mapping[str, Measure],
    exact: Exact | None = None, draw: Callable[[Family, int, int], Iterator[ImpactCase]] = draw_of_rank,
) -> dict[str, Any]:  # fmt: skip
    """Return the row of one batch of `count` impacts."""
    part, family, e = case
    rational = exact is not None and part in exact.errors
    count = max(count // 4, 4) if rational else count  # at least 4 impacts, so that three batches have at least ten
    impacts = list((whole_numbers if rational else draw)(family, count, study.seed))
    batch = Batch(impacts, family, e, study.seed)
    measure = Measure(exact.errors[part], lambda _: 0.0) if exact and rational else parts[part]
    return {
        "part": part, "coordinates": family.coordinates, "contacts": family.contacts,
        "condition number": None if rational else family.condition_number, "restitution": e, "impacts": count,
        "error": measure.error(batch), "bound": measure.bound(batch),
    }  # fmt: skip


def algebraic_claim(
    *, families: Sequence[Family], restitutions: Sequence[float], parts: Mapping[str, Measure],
    impacts: Mapping[str, int], exact: Exact | None = None,
    draw: Callable[[Family, int, int], Iterator[ImpactCase]] = draw_of_rank, **words: Any,
) -> Claim:  # fmt: skip
    """Return a claim on batches of random impacts; `words` are the other fields of Claim.

    impacts : number of impacts in one batch, by depth; draw : (family, count, seed) -> the impacts of a batch
    """
    return Claim(
        columns=COLUMNS, cases=lambda study: cases_of(families, restitutions, parts, exact), holds=within_bound,
        trials=lambda study, case: [trial_of(study, case, impacts[study.depth], parts, exact, draw)], **words,
    )  # fmt: skip


def within_bound(row: Row) -> bool | None:
    """Return whether the largest error of a batch is at most its bound; False if the error is not a number."""
    return bool(row["error"] <= row["bound"])


def energy_bound(batch: Batch) -> float:
    """Relative energy gain that rounding alone may cause: 10 d ε √κ(M), the bound that the resolver documents."""
    return 10.0 * batch.family.coordinates * EPSILON * float(np.sqrt(batch.family.condition_number))


def solve_bound(batch: Batch) -> float:
    """Relative error allowed for quantities computed with one solve with M or with W: 100 d ε κ(M)."""
    return 100.0 * batch.family.coordinates * EPSILON * batch.family.condition_number


def kinetic_energy(mass_matrix: Floats, velocity: Floats) -> float:
    """½ vᵀ M v [J]."""
    return 0.5 * float(velocity @ mass_matrix @ velocity)


def energy_gains(instances: Sequence[ImpactCase], velocities: Sequence[Floats]) -> Floats:
    """Relative energy gain of each impact in double-double arithmetic, plus the error bound of that arithmetic."""
    masses = np.stack([instance.mass_matrix for instance in instances])
    before = np.stack([instance.velocity for instance in instances])
    gain, uncertainty = bulk_energy_gain(masses, before, np.stack(velocities))
    return gain + uncertainty


def quadratic_form(instance: ImpactCase) -> float:
    """vᵀ Jᵀ W† J v [J] with W = J M⁻¹ Jᵀ, from the independent rows: the form of (18) and (24) without a factor."""
    rows = instance.contact_jacobian[: instance.rank]
    closing = rows @ instance.velocity
    delassus = rows @ np.linalg.solve(instance.mass_matrix, rows.T)
    return float(closing @ np.linalg.solve(delassus, closing))


def worst(values: Iterable[float]) -> float:
    """Largest of the values; infinite if a value is not a number."""
    array = np.fromiter(values, np.float64)
    return float(np.max(np.where(np.isnan(array), np.inf, array), initial=0.0))


def summary(table: Table, part: str) -> str:
    """Return the text `at most e (allowed b) in n impacts` for one part of a claim."""
    rows = table.where(part=part).records()
    if not rows:
        return "not computed"
    closest = max(rows, key=lambda row: row["error"] / row["bound"] if row["bound"] else row["error"])
    impacts = sum(row["impacts"] for row in rows)
    return f"at most {closest['error']:.1e} (allowed {closest['bound']:.1e}) in {impacts} impacts"

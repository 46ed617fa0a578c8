"""Energy lost in random impacts against the quadratic form of (18) and (24): shared by C01 and C02."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from iapb import resolve_impact
from verification.claims.algebraic import (
    energy_bound,
    energy_gains,
    kinetic_energy,
    quadratic_form,
    solve_bound,
    worst,
)
from verification.impacts import Family, ImpactCase, draw_of_rank, whole_numbers

if TYPE_CHECKING:
    from verification.claims.study import Study

PASSIVE = "kinetic energy does not rise"
WITH_HALF = "loss is ½(1 − e²) of the form"
AS_PRINTED = "loss is (1 − e²) of the form, as printed"
EXACT = "loss is ½(1 − e²) of the form, in rationals"
RESTITUTIONS = (0.0, 0.5, 0.9, 1.0)


def loss_batches(study: Study, families: Sequence[Family], count: int) -> Iterator[dict[str, Any]]:
    """Yield the parts of the claim for every family and restitution."""
    exact = [family for family in families if family.condition_number == families[0].condition_number]
    yield from study.each(product(families, RESTITUTIONS), lambda case: _batch(*case, count, study.seed))
    yield from study.each(exact, lambda family: [_exact_batch(family, 0.5, max(count // 4, 2), study.seed)])


def _batch(family: Family, e: float, count: int, seed: int) -> Iterator[dict[str, Any]]:
    instances = list(draw_of_rank(family, count, seed))
    after = [resolve_impact(*instance.arrays, e).velocity for instance in instances]
    forms = np.array([quadratic_form(instance) for instance in instances])
    energy = np.array([kinetic_energy(i.mass_matrix, i.velocity) for i in instances])
    gains = energy_gains(instances, after)
    share = (1.0 - e * e) * forms / energy
    bound = solve_bound(family.coordinates, family.condition_number)
    common = {**_names(family), "restitution": e, "impacts": count}
    yield {**common, "part": PASSIVE, "error": max(float(gains.max()), 0.0),
           "bound": energy_bound(family.coordinates, family.condition_number)}  # fmt: skip
    yield {**common, "part": WITH_HALF, "error": worst(np.abs(gains + 0.5 * share)), "bound": bound}
    yield {**common, "part": AS_PRINTED, "error": worst(np.abs(gains + share)), "bound": bound}


def _exact_batch(family: Family, e: float, count: int, seed: int) -> dict[str, Any]:
    misfits = [abs(_exact_misfit(instance, Fraction(e))) for instance in whole_numbers(family, count, seed)]
    return {**_names(family), "condition number": None, "part": EXACT, "restitution": e, "impacts": count,
            "error": worst(map(float, misfits)), "bound": 0.0}  # fmt: skip


def _exact_misfit(instance: ImpactCase, e: Fraction) -> Fraction:
    """Loss minus ½(1 − e²) vᵀJᵀW†Jv, both without rounding."""
    from reference.exact import exact_impact

    mass, rows, velocity = instance.arrays
    after = exact_impact(mass, rows, velocity, e)
    plastic = exact_impact(mass, rows, velocity, 0)
    # e = 0 sends v to v − Pv, so vᵀM(v − v⁺) = vᵀMPv is the form itself: independent of the loss at e.
    form = -sum((Fraction(x) * p for x, p in zip(velocity, plastic.generalized_impulse, strict=True)), Fraction(0))
    return after.energy_before - after.energy_after - (1 - e * e) * form / 2


def _names(family: Family) -> dict[str, Any]:
    return {"coordinates": family.coordinates, "contacts": family.contacts,
            "condition number": family.condition_number}  # fmt: skip

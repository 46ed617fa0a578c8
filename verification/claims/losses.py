"""Compare the energy lost in random impacts with the quadratic form of (18) and (24); C01 and C02 use this."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from iapb import resolve_impact
from reference.exact import exact_impact
from verification.claims.algebraic import (
    Batch,
    Exact,
    Measure,
    algebraic_claim,
    energy_bound,
    energy_gains,
    kinetic_energy,
    quadratic_form,
    solve_bound,
    summary,
    worst,
)
from verification.claims.claim import Claim
from verification.finding import Table
from verification.impacts import Family, Floats, ImpactCase

PASSIVE = "kinetic energy does not rise"
WITH_HALF = "loss is ½(1 − e²) of the form"
AS_PRINTED = "loss is (1 − e²) of the form, as printed"
EXACT = "loss is ½(1 − e²) of the form, in rationals"
RESTITUTIONS = (0.0, 0.5, 0.9, 1.0)


def loss_claim(id: str, statement: str, place: str, families: Sequence[Family], impacts: Mapping[str, int]) -> Claim:
    """Return the claim that the loss equals the quadratic form: as printed, and with the factor ½ missing in print."""
    first = [family for family in families if family.condition_number == families[0].condition_number]

    def finding(table: Table) -> str:
        return (
            f"Relative energy gain: {summary(table, PASSIVE)}. The loss is half of the quadratic form printed in "
            f"{place}. Difference between loss and form with the factor ½: {summary(table, WITH_HALF)}; without it: "
            f"{summary(table, AS_PRINTED)}; with it, in rational arithmetic: {summary(table, EXACT)}."
        )

    return algebraic_claim(
        id=id, statement=statement, place=place, families=families, restitutions=RESTITUTIONS, impacts=impacts,
        quantity="Largest relative energy gain; largest difference between the loss and the quadratic form, relative "
        "to the energy before.",
        tolerance="Gain: 10 d ε √κ(M), the rounding of the returned velocities. Difference: 100 d ε κ(M), the rounding "
        "of one solve with M. In rational arithmetic: zero.",
        parts={
            PASSIVE: Measure(lambda batch: max(float(_gains(batch).max()), 0.0), energy_bound),
            WITH_HALF: Measure(lambda batch: worst(np.abs(_gains(batch) + 0.5 * _shares(batch))), solve_bound),
            AS_PRINTED: Measure(lambda batch: worst(np.abs(_gains(batch) + _shares(batch))), solve_bound),
        },
        exact=Exact(first, 0.5, {EXACT: _exact}), finding=finding,
    )  # fmt: skip


def _gains(batch: Batch) -> Floats:
    after = [resolve_impact(*case.arrays, batch.restitution).velocity for case in batch.impacts]
    return energy_gains(batch.impacts, after)


def _shares(batch: Batch) -> Floats:
    """(1 − e²) times the quadratic form, relative to the energy before the impact."""
    forms = np.array([quadratic_form(case) for case in batch.impacts])
    energy = np.array([kinetic_energy(case.mass_matrix, case.velocity) for case in batch.impacts])
    return np.asarray((1.0 - batch.restitution**2) * forms / energy)


def _exact(batch: Batch) -> float:
    return worst(float(abs(_exact_misfit(case, Fraction(batch.restitution)))) for case in batch.impacts)


def _exact_misfit(instance: ImpactCase, e: Fraction) -> Fraction:
    """Loss minus ½(1 − e²) vᵀJᵀW†Jv, in rational arithmetic."""
    mass, rows, velocity = instance.arrays
    after = exact_impact(mass, rows, velocity, e)
    plastic = exact_impact(mass, rows, velocity, 0)
    # With e = 0, v⁺ = v − Pv, so vᵀM(v − v⁺) = vᵀMPv is the quadratic form, computed independently of the loss at e.
    form = -sum((Fraction(x) * p for x, p in zip(velocity, plastic.generalized_impulse, strict=True)), Fraction(0))
    return after.energy_before - after.energy_after - (1 - e * e) * form / 2

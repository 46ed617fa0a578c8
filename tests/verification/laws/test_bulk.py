"""The bulk study: the bound on the energy gain holds with the clamp, and is not kept by accident
without.

Adverse impacts of each family: none gains energy in exact arithmetic; without the last step some
do.
"""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact
from reference.exact import relative_energy_gain
from reports.evidence.exact_energy import verdict_of_families
from verification.certificate import judge_gains
from verification.finding import NOT_TESTABLE, REFUTED, REPRODUCED
from verification.impacts import ADVERSE_FAMILIES, Impacts, draw_impacts
from verification.laws import ImpactCase, bulk_impacts
from verification.laws.bounds import FACTORED
from verification.laws.bulk import GAIN, exact_energy, resolved
from verification.table import HOLDS

DEPTH = 2000


def test_the_gain_stays_below_ten_d_eps_root_kappa() -> None:
    study = bulk_impacts(DEPTH, seed=1)
    assert (study.gain <= study.bound).all()
    assert (
        study.condition.max() > 1e11 and study.contacts.max() > 90 and study.coordinates.max() > 25
    )
    assert (study.rank < np.minimum(study.contacts, study.coordinates)).any()
    assert study.residual.max() <= 1e-6


def test_the_clamp_is_what_keeps_the_bound() -> None:
    """An impact of written numbers and a resolver without BLAS: the same gain on every
    processor."""
    T, D = (
        np.array([[1.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [-2.0, 1.0, 1.0]]),
        np.array([1e-3, 1e-11, 1e-11]),
    )
    M = np.sum(T[:, None, :] * D * T[None, :, :], axis=2)
    J, v = np.array([[1.0, 0.0, 3.0]]), np.array([0.0, -2.0, 2.0])
    bound = FACTORED.energy_gain(ImpactCase(M, J, v, 1.0))
    gains = [
        relative_energy_gain(M, v, resolve_impact(M, J, v, 1.0, clamp=clamp).velocity)
        for clamp in (False, True)
    ]
    assert gains[0] > 10.0 * bound and gains[1] <= bound


def test_the_same_seed_gives_the_same_numbers_and_the_tables_add_up() -> None:
    first = bulk_impacts(300, seed=4)
    assert np.array_equal(first.gain, bulk_impacts(300, seed=4).gain)
    *rows, total = first.by_condition()
    assert (
        sum(row["impacts"] for row in rows) == total["impacts"] == 300
        and total[GAIN] == first.gain.max()
    )


@pytest.mark.parametrize("family", ADVERSE_FAMILIES)
def test_no_impact_of_the_family_gains_energy_and_the_price_is_one_rounding(family: str) -> None:
    found = exact_energy(family, 1000)
    assert found["gains"] == 0 and found["impacts"] == 1000
    assert (
        found["moved"] > 0.95 and found[HOLDS] is True
    )  # 0 gains of impacts that leave v as it is would say nothing
    assert found["cancelled"] <= (100 if family == "subnormal velocities" else 0)
    assert found["largest energy cost"] is None or found["largest energy cost"] <= 1.0


@pytest.mark.parametrize("family", ADVERSE_FAMILIES[:4])
def test_without_the_last_step_the_judge_finds_gains(family: str) -> None:
    given = draw_impacts(np.random.default_rng(1), family, 2000, 4, 3)
    assert judge_gains(given.mass, given.v, resolved(given, clamped=False)[0]).gained.sum() > 50


def test_a_family_whose_impacts_do_not_move_is_not_reproduced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def idle(
        impacts: Impacts, clamped: bool = True, *, scale: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        return impacts.v.copy(), np.ones(len(impacts.v))

    monkeypatch.setattr("verification.laws.bulk.resolved", idle)
    found = exact_energy("ordinary", 100)
    assert found["gains"] == 0 and found["moved"] == 0.0 and found[HOLDS] is None
    assert verdict_of_families([True, found[HOLDS]]) == NOT_TESTABLE
    assert (
        verdict_of_families([False, None]) == REFUTED
        and verdict_of_families([True, True]) == REPRODUCED
    )

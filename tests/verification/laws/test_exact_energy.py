"""Adverse impacts of each family through the compiled resolver: none gains energy; without the last step some do."""

from __future__ import annotations

import numpy as np
import pytest

from iapb import resolve_impact
from iapb.advice.certificate import judge_gains
from reports.evidence.exact_energy import verdict_of_families
from verification.finding import NOT_TESTABLE, REFUTED, REPRODUCED
from verification.laws.exact_energy import FAMILIES, SCALED, Impacts, exact_energy, resolved


@pytest.mark.parametrize("family", FAMILIES)
def test_no_impact_of_the_family_gains_energy_and_the_price_is_one_rounding(family: str) -> None:
    found = exact_energy(family, 3000)
    assert found.gains == 0 and found.impacts == 3000
    assert found.moved > 0.95 and found.holds is True  # 0 gains of impacts that leave v as it is would say nothing
    assert found.cancelled <= (100 if family == "subnormal velocities" else 0)
    assert np.isnan(found.price[2]) or found.price[2] <= 1.0


@pytest.mark.parametrize("family", [name for name in FAMILIES if name not in ("subnormal velocities", "600 decades")])
def test_without_the_last_step_the_judge_finds_gains(family: str) -> None:
    given = FAMILIES[family](np.random.default_rng(1), 2000, 4, 3)
    given = type(given)(*(np.ascontiguousarray(array) for array in given))
    assert judge_gains(given.mass, given.v, resolved(given, clamped=False)[0]).gained.sum() > 50


@pytest.mark.parametrize("family", SCALED)
def test_scaled_impacts_are_those_of_resolve_impact(family: str) -> None:
    given = FAMILIES[family](np.random.default_rng(1), 200, 4, 3)
    given = type(given)(*(np.ascontiguousarray(array) for array in given))
    v_plus = resolved(given, scale=True)[0]
    for k in range(200):
        one = resolve_impact(given.mass[k], given.rows[k].T, given.v[k], float(given.restitution[k]))
        unit = np.sqrt(given.mass[k].diagonal())  # the last bits differ: M is symmetric only to rounding here
        off, size = np.abs(unit * (v_plus[k] - one.velocity)), np.abs(unit * given.v[k])
        assert off.max() <= 1e-11 * size.max() and (v_plus[k] != given.v[k]).any()


def test_a_family_whose_impacts_do_not_move_is_not_reproduced(monkeypatch: pytest.MonkeyPatch) -> None:
    def idle(impacts: Impacts, clamped: bool = True, *, scale: bool = False) -> tuple[np.ndarray, np.ndarray]:
        return impacts.v.copy(), np.ones(len(impacts.v))
    monkeypatch.setattr("verification.laws.exact_energy.resolved", idle)
    found = exact_energy("ordinary", 100)
    assert found.gains == 0 and found.moved == 0.0 and found.holds is None
    assert verdict_of_families([True, found.holds]) == NOT_TESTABLE
    assert verdict_of_families([False, None]) == REFUTED and verdict_of_families([True, True]) == REPRODUCED

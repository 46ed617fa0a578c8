"""Adverse impacts of each family through the compiled resolver: none gains energy; without the last step some do."""

from __future__ import annotations

import numpy as np
import pytest

from iapb.certificate import judge_gains
from verification.laws.exact_energy import FAMILIES, exact_energy, resolved


@pytest.mark.parametrize("family", FAMILIES)
def test_no_impact_of_the_family_gains_energy_and_the_price_is_one_rounding(family: str) -> None:
    found = exact_energy(family, 3000)
    assert found.gains == 0 and found.impacts == 3000
    assert found.cancelled <= (100 if family == "subnormal velocities" else 0)
    assert np.isnan(found.price[2]) or found.price[2] <= 1.0


@pytest.mark.parametrize("family", [name for name in FAMILIES if name not in ("subnormal velocities", "600 decades")])
def test_without_the_last_step_the_judge_finds_gains(family: str) -> None:
    given = FAMILIES[family](np.random.default_rng(1), 2000, 4, 3)
    given = type(given)(*(np.ascontiguousarray(array) for array in given))
    assert judge_gains(given.mass, given.v, resolved(given, clamped=False)[0]).gained.sum() > 50

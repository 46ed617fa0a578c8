"""Every law on impacts that hypothesis draws: our resolver against the bounds it proves, up to κ(M)
= 1e14."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given

from iapb import resolve_impact
from verification.impacts import ImpactCase
from verification.laws.bounds import FACTORED, KIT, LawCount, LawResidual
from verification.laws.equality import LAWS
from verification.laws.resolver import Resolver
from verification.laws.strategies import impacts
from verification.methods import damped, svd


@pytest.mark.parametrize("law", LAWS)
@given(case=impacts(largest_exponent=14))
def test_the_default_method_keeps_its_proved_bounds(law: str, case: ImpactCase) -> None:
    residual = LAWS[law].check(case, resolve_impact, FACTORED)
    assert residual is None or residual.passed, residual


@given(case=impacts(largest_exponent=14))
@pytest.mark.parametrize("method", [damped, svd])
def test_filters_of_the_family_are_passive(method: Resolver, case: ImpactCase) -> None:
    residual = LAWS["kinetic_energy"].check(case, method, KIT)
    assert residual is not None and residual.passed, residual


def test_an_unknown_residual_never_passes() -> None:
    assert not LawResidual("any", np.nan, 1.0).passed
    assert not LawResidual("any", np.inf, 1.0).passed
    assert not LawResidual("any", 1e-30, 0.0).passed
    assert LawResidual("any", 0.0, 0.0).passed and LawResidual("any", -1.0, 1e-9).passed
    count = LawCount("any")
    assert [count.add(LawResidual("", value, 1.0)) for value in (0.5, np.nan, 2.0)] == [
        True,
        False,
        False,
    ]
    assert (count.checked, count.failures) == (3, 2) and np.isnan(count.worst.value)
    assert ((count + count).checked, (count + count).failures) == (6, 4)  # of two workers


def test_a_rebound_too_weak_and_one_too_strong_are_the_same_residual() -> None:
    case = ImpactCase(np.eye(1), np.eye(1), np.array([-1.0]), 0.5)
    assert [case.unmet_restitution(np.array([after])) for after in (0.25, 0.5, 0.75)] == [
        0.25,
        0.0,
        0.25,
    ]


def test_restitution_is_judged_to_rounding_where_rows_are_independent() -> None:
    case = ImpactCase(np.eye(2), np.eye(2), np.array([-1.0, -2.0]), 0.5)
    residual = LAWS["restitution"].check(case, lambda M, J, v, e: -e * v * (1.0 + 1e-9), KIT)
    assert residual is not None and not residual.passed


def test_momentum_that_appears_is_found_though_it_is_the_same_in_every_frame() -> None:
    case = ImpactCase(
        np.eye(2), np.array([[1.0, -1.0]]), np.array([-1.0, 1.0]), 0.5, translations=np.ones((1, 2))
    )
    residual = LAWS["momentum"].check(case, lambda M, J, v, e: v + (1.0, 0.0), KIT)
    assert residual is not None and not residual.passed


def test_rows_that_agree_to_noise_are_not_compared() -> None:
    """Rows 6e-14 apart are one row for a resolver in doubles and two for one in rational numbers."""
    for apart, certain in ((0.0, True), (6e-14, False), (1e-9, False), (1e-3, True)):
        rows = np.array([[1.0, 0.0], [1.0, apart]])
        case = ImpactCase(np.eye(2), rows, np.array([-1.0, 1.0]), 1.0)
        assert case.is_separated is certain
        judged = LAWS["row_order"].check(case, resolve_impact, FACTORED)
        assert (judged is not None) is certain

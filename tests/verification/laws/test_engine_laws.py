"""Laws of budgets, device limits, the wall in the hand and extreme inputs: the engine keeps
them."""

from __future__ import annotations

import pytest

from verification.laws.engine import (
    ENGINE_LAWS,
    judge_engine_law,
    leak,
    penalty_wall,
    quickest_motion,
)
from verification.laws.planted import PLANTED_ENGINE_FAULTS

# three simulations a case; a resolver call per budget; a rigid contact in every step
CASES = {"group_splitting": 8, "truncation": 80, "device_port": 12}


@pytest.mark.parametrize("law", ENGINE_LAWS)
def test_the_engine_keeps_the_law(law: str) -> None:
    cases = CASES.get(law, 150)
    count = judge_engine_law(law, cases=cases)
    assert not count.failures and count.checked == cases, count


@pytest.mark.parametrize("law", ENGINE_LAWS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # the faults compute with what overflows
def test_the_planted_fault_breaks_the_law(law: str) -> None:
    assert judge_engine_law(
        law, PLANTED_ENGINE_FAULTS[law].make(), cases=min(60, CASES.get(law, 60))
    ).failures


@pytest.mark.parametrize("damping", [0.0, 50.0])
def test_below_the_bound_the_quickest_motion_gets_energy_and_at_the_bound_none(
    damping: float,
) -> None:
    K, dt = 1000.0, 1.0 / 512.0
    bound = 0.5 * K * dt + damping
    leaks = [
        leak(quickest_motion(K, damping, share * bound, dt), penalty_wall)
        for share in (0.5, 0.9, 1.0)
    ]
    assert leaks[0] > leaks[1] > 0.0 and leaks[2] < 1e-12 * leaks[0]
    assert (
        ENGINE_LAWS["hand_port"].check(quickest_motion(K, damping, bound, dt), penalty_wall).passed
    )

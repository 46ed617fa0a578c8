"""Laws of budgets and groups: the engine keeps them."""

from __future__ import annotations

import pytest

from verification.laws.engine import ENGINE_LAWS, judge_engine_law
from verification.laws.planted import PLANTED_ENGINE_FAULTS

# three simulations a case; a resolver call per budget
CASES = {"group_splitting": 8, "truncation": 80}


@pytest.mark.parametrize("law", ENGINE_LAWS)
def test_the_engine_keeps_the_law(law: str) -> None:
    cases = CASES.get(law, 150)
    count = judge_engine_law(law, cases=cases)
    assert not count.failures and count.checked == cases, count


@pytest.mark.parametrize("law", ENGINE_LAWS)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # the faults compute with what overflows
def test_the_planted_fault_breaks_the_law(law: str) -> None:
    assert judge_engine_law(
        law, PLANTED_ENGINE_FAULTS[law].make(), cases=min(60, CASES.get(law, 60) // 2)
    ).failures

"""Anytime property: every truncation of the projector is passive, so a row budget never costs passivity."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from iapb import resolve_impact
from verification.impacts import Floats, ImpactCase, draw_case
from verification.laws.bounds import FACTORED, LawResidual
from verification.laws.impact_laws import relative_gain
from verification.laws.resolver import outcome

Budgeted = Callable[[Floats, Floats, Floats, float, int], Any]  # (M, J, v, e, budget) -> v⁺
LARGEST_CONDITION = 1e12


def draw(rng: np.random.Generator) -> ImpactCase:
    """Draw an impact of any family."""
    return draw_case(rng, LARGEST_CONDITION)


def ours(M: Floats, J: Floats, v: Floats, e: float, budget: int) -> Any:
    """Call the engine's resolver; it stops after `budget` rows."""
    return resolve_impact(M, J, v, e, budget=budget)


def _in_budget(subject: Budgeted, budget: int, M: Floats, J: Floats, v: Floats, e: float) -> Any:
    return subject(M, J, v, e, budget)


def every_budget_is_passive(case: ImpactCase, subject: Budgeted) -> LawResidual:
    """Largest relative energy gain over all budgets; infinite if a budget of 0 rows still gives an impulse."""
    worst = -np.inf
    for budget in range(min(case.contacts, case.coordinates) + 1):
        v_plus = outcome(partial(_in_budget, subject, budget), case)
        worst = max(worst, relative_gain(case, v_plus))
        if budget == 0 and not np.array_equal(v_plus, case.velocity):
            worst = np.inf
    return LawResidual("truncation", worst, FACTORED.energy_gain(case))

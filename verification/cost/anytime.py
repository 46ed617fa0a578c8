"""The anytime resolver: what a budget of rows leaves of the restitution, and that no budget gains energy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from iapb import resolve_impact
from reference.exact import relative_energy_gain
from verification.cost.kernels import random_impact
from verification.finding import Failure, attempt

SIZES = ((6, 24), (12, 60), (30, 120))  # (d, c), rows of rank two thirds of d


@dataclass(frozen=True)
class BudgetRow:
    """Impacts of one size under one budget; residuals are max |Jᵢv⁺ + e Jᵢv⁻| / (‖Aᵢ‖ |u|).

    unmet : median, worst : largest residual; most_gain : largest (KE⁺ − KE⁻)/KE⁻, exactly; lost : median share of the
    energy that the full impact takes
    """

    coordinates: int
    contacts: int
    rank: int
    budget: int
    impacts: int
    unmet: float
    worst: float
    most_gain: float
    lost: float


def anytime(
    impacts: int = 40, seed: int = 0, progress: Callable[[int, int], None] | None = None,
    failures: list[Failure] | None = None,
) -> tuple[BudgetRow, ...]:
    """Resolve random plastic impacts with every budget from 0 rows to the rank."""
    found = []
    for done, (d, c) in enumerate(SIZES, start=1):
        cases = [random_impact(d, c, np.random.default_rng([seed, d, c, k])) for k in range(impacts)]
        rank = max(1, (2 * d) // 3)
        found += [attempt(f"budget of {budget} rows, d = {d}, c = {c}", partial(_row, d, c, rank, budget, cases),
                          failures) for budget in range(rank + 1)]  # fmt: skip
        if progress is not None:
            progress(done, len(SIZES))
    return tuple(row for row in found if row is not None)


def _row(d: int, c: int, rank: int, budget: int, cases: list[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> BudgetRow:
    residuals, gains, lost = [], [], []
    for mass, rows, v in cases:
        v_plus = resolve_impact(mass, rows, v, 0.0, budget=budget).velocity
        full = resolve_impact(mass, rows, v, 0.0).velocity
        lower = np.linalg.cholesky(mass)
        scale = np.linalg.norm(np.linalg.solve(lower, rows.T), axis=0) * np.linalg.norm(lower.T @ v)
        residuals.append(float(np.max(np.abs(rows @ v_plus) / scale)))
        gains.append(relative_energy_gain(mass, v, v_plus))
        before, after, least = (0.5 * float(w @ mass @ w) for w in (v, v_plus, full))
        lost.append((before - after) / (before - least))
    return BudgetRow(d, c, rank, budget, len(cases), float(np.median(residuals)), max(residuals), max(gains),
                     float(np.median(lost)))  # fmt: skip

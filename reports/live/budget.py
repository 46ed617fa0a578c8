"""How many rows an impact may use in the time that is left: the anytime resolver on a deadline.

The resolver takes the most violated row first, and whatever prefix of its work is done is passive (paper section V),
so stopping early costs accuracy only. What a row takes is measured before the loop starts; what a step takes besides
is the most that it took of late. The budgets given are recorded, so that a run can be done again exactly.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from iapb.contact.impact import resolve_impact
from iapb.simulation import Simulation

_RESERVE = 0.1  # share of the period that is kept back: for the clock, and for what other programs take
_FORGETTING = 0.01  # share by which the largest fixed cost seen fades per step: gone after a few hundred
_ROWS = 200  # most rows of the calibrating impact
_REPEATS = 15
_CHEAPEST_ROW = 1e-8  # [s] a few dozen operations: less is what is left of noise where an impact has few rows


class RowCost(NamedTuple):
    """What a step takes [s]: `fixed`, and `per_row` for each row that an impact uses."""

    fixed: float
    per_row: float


class RowBudget:
    """Turns time left into rows.

    Parameters
    ----------
    cost : RowCost
    period : float [s]
    dofs : rows that are never exceeded, for more cannot be independent.
    islands : impacts that a step can have; the rows are shared out evenly among them.
    """

    def __init__(self, cost: RowCost, period: float, dofs: int, islands: int) -> None:
        self.fixed, self.per_row = cost
        self._reserve, self._dofs, self._islands = _RESERVE * period, dofs, max(islands, 1)

    def rows(self, left: float) -> int:
        """Return how many rows each impact may use where `left` [s] are left; at least the most violated one."""
        spare = left - self.fixed - self._reserve
        if spare >= self.per_row * self._dofs:
            return self._dofs
        return int(max(1, min(self._dofs, spare / self.per_row / self._islands)))

    def learn(self, seconds: float, rows: int) -> None:
        """Take note of a step that took `seconds` and used `rows` rows."""
        fixed = seconds - self.per_row * rows
        self.fixed = max(fixed, self.fixed + _FORGETTING * (fixed - self.fixed))


def calibrated(simulation: Simulation, period: float) -> RowBudget:
    """Measure what a row takes on this machine in an impact as large as the scene can have."""
    dofs = simulation.system.mechanism.nv
    count = int(np.clip(simulation.system.capacity, 1, _ROWS))
    cost = RowCost(0.0, _seconds_per_row(dofs, count))
    return RowBudget(cost, period, dofs, len(simulation.system.mechanism.tree_dofs))


def _seconds_per_row(dofs: int, count: int) -> float:
    """Slope of the time of one impact over the rows that it may use, by the fastest of some repetitions."""
    random = np.random.default_rng(0)
    rows, velocity = random.normal(size=(count, dofs)), random.normal(size=dofs)
    budgets = np.unique([1, min(dofs, count)])
    times = []
    for budget in budgets:
        taken = []
        for _ in range(_REPEATS):
            started = time.perf_counter()
            resolve_impact(np.eye(dofs), rows, velocity, 0.0, budget=int(budget))
            taken.append(time.perf_counter() - started)
        times.append(min(taken))
    slope = (times[-1] - times[0]) / max(budgets[-1] - budgets[0], 1)
    return max(float(slope), _CHEAPEST_ROW)

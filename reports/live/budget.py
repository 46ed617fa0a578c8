"""Row budgets: how many rows an impact may use in the time before the deadline (anytime resolver).

The resolver takes the most violated row first. After each row the result is passive (paper section V), so stopping
early reduces only the accuracy. The time per row is measured before the loop starts. The time of the rest of a step is
estimated by its recent maximum. The budgets are recorded, so that a run can be repeated exactly.
"""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

from iapb.contact.impact import resolve_impact
from iapb.simulation import Simulation

_RESERVE = 0.1  # share of the period that is reserved for the clock and for other programs
_FORGETTING = 0.01  # share by which the largest fixed cost decays per step: it is forgotten after a few hundred steps
_ROWS = 200  # largest number of rows of the calibration impact
_REPEATS = 15
_CHEAPEST_ROW = 1e-8  # [s] a few dozen operations; a smaller measured time per row is noise


class RowCost(NamedTuple):
    """The time of a step [s]: `fixed`, plus `per_row` for each row that an impact uses."""

    fixed: float
    per_row: float


class RowBudget:
    """Converts the remaining time into a number of rows.

    Parameters
    ----------
    cost : RowCost
    period : float [s]
    dofs : largest number of rows of an impact, because more rows cannot be independent.
    islands : largest number of impacts in a step; the rows are distributed evenly among them.
    """

    def __init__(self, cost: RowCost, period: float, dofs: int, islands: int) -> None:
        self.fixed, self.per_row = cost
        self._reserve, self._dofs, self._islands = _RESERVE * period, dofs, max(islands, 1)

    def rows(self, left: float) -> int:
        """Return how many rows each impact may use in the remaining time `left` [s]; at least one row."""
        spare = left - self.fixed - self._reserve
        if spare >= self.per_row * self._dofs:
            return self._dofs
        return int(max(1, min(self._dofs, spare / self.per_row / self._islands)))

    def learn(self, seconds: float, rows: int) -> None:
        """Update the estimate of the fixed time with a step that took `seconds` and used `rows` rows."""
        fixed = seconds - self.per_row * rows
        self.fixed = max(fixed, self.fixed + _FORGETTING * (fixed - self.fixed))


def calibrated(simulation: Simulation, period: float) -> RowBudget:
    """Measure the time per row on this machine, in an impact of the largest size that is possible in the scene."""
    dofs = simulation.system.mechanism.nv
    count = int(np.clip(simulation.system.capacity, 1, _ROWS))
    cost = RowCost(0.0, _seconds_per_row(dofs, count))
    return RowBudget(cost, period, dofs, len(simulation.system.mechanism.tree_dofs))


def _seconds_per_row(dofs: int, count: int) -> float:
    """Return the time of an impact per additional row, from the fastest of some repetitions."""
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

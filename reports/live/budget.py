"""Row budgets: how many rows an impact may use in the time before the deadline (anytime resolver).

The resolver takes the most violated row first. After each row the result is passive (paper section V), so stopping
early reduces only the accuracy. The time per row is measured before the loop starts. The time of the rest of a step is
estimated by its recent maximum. The budgets are recorded, so that a run can be repeated exactly.
"""

from __future__ import annotations

import timeit

import numpy as np

from iapb.contact.impact import resolve_impact
from iapb.simulation import Simulation

_RESERVE = 0.1  # share of the period that is reserved for the clock and for other programs
_FORGETTING = 0.01  # share by which the largest fixed cost decays per step: it is forgotten after a few hundred steps
_ROWS = 200  # largest number of rows of the calibration impact
_REPEATS = 15
_CHEAPEST_ROW = 1e-8  # [s] a few dozen operations; a smaller measured time per row is noise


class RowBudget:
    """Converts the remaining time into a number of rows.

    Parameters
    ----------
    fixed, per_row : float [s], the time of a step is `fixed`, plus `per_row` for each row that an impact uses.
    period : float [s]
    dofs : largest number of rows of an impact, because more rows cannot be independent.
    islands : largest number of impacts in a step; the rows are distributed evenly among them.
    """

    def __init__(self, fixed: float, per_row: float, period: float, dofs: int, islands: int) -> None:
        self.fixed, self.per_row = fixed, per_row
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
    mechanism, random = simulation.system.mechanism, np.random.default_rng(0)
    dofs, count = mechanism.nv, int(np.clip(simulation.system.capacity, 1, _ROWS))
    rows, velocity = random.normal(size=(count, dofs)), random.normal(size=dofs)

    def fastest(budget: int) -> float:
        return min(timeit.repeat(lambda: resolve_impact(np.eye(dofs), rows, velocity, 0.0, budget=budget),
                                 number=1, repeat=_REPEATS))

    most = min(dofs, count)
    slope = (fastest(most) - fastest(1)) / max(most - 1, 1)
    return RowBudget(0.0, max(slope, _CHEAPEST_ROW), period, dofs, len(mechanism.tree_dofs))

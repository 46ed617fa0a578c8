"""A wall whose force is bounded by the energy that its device dissipates: after J.-P. Kim, J. Ryu,
"Robustly stable haptic interaction control using an energy-bounding algorithm", International Journal
of Robotics Research, 2010. The bound is written here for one period.

In a period the hand draws at most max over Δx of FΔx − bΔx²/T = F²T/4b. With |F| ≤ √(4bE/T) that
is at most the energy E in store, so the law needs its own b, and no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass
class EnergyBounding:
    """A wall with `step(x, v)`, bounded for a device of this damping [N s/m]."""

    wall: Any
    damping: float

    def reset(self, dt: float) -> None:
        """Begin with an empty store."""
        self.dt = dt
        self.energy = 0.0
        self.force = 0.0

    def step(self, x: float, v: float) -> float:
        """Return the force on the hand [N]."""
        moved = v * self.dt
        self.energy += self.damping * v * moved - self.force * moved
        self.energy = max(self.energy, 0.0)  # below 0 by rounding only
        most = (4.0 * self.damping * self.energy / self.dt) ** 0.5
        self.force = min(max(self.wall.step(x, v), -most), most)
        return self.force

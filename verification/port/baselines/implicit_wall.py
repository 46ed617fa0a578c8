"""A wall integrated by backward Euler together with the device's mass: D. Baraff, A. Witkin, "Large
steps in cloth simulation", SIGGRAPH 1998, 43-54, for one contact.

F = −K x⁺ − B v⁺ with v⁺ = v + T F/m and x⁺ = x + T v⁺ gives F = −K′x − B′v with
K′ = K/(1 + BT/m + KT²/m) and B′ = (B + KT) K′/K. At the port it needs K′T/2 + B′.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class ImplicitWall:
    """A wall at x > 0 that only pushes; mass m of the device [kg]."""

    stiffness: float
    damping: float = 0.0
    mass: float = 1.0

    def reset(self, dt: float) -> None:
        """Compute the gains."""
        share = 1.0 / (1.0 + (self.damping + self.stiffness * dt) * dt / self.mass)
        self.gains = share * self.stiffness, share * (self.damping + self.stiffness * dt)

    def step(self, x: float, v: float) -> float:
        """Return the force on the hand [N]."""
        return -max(self.gains[0] * x + self.gains[1] * v, 0.0) if x > 0.0 else 0.0

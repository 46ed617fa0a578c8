"""A spring that is evaluated half a period ahead, which removes the energy of a sampled spring in
uniform motion: the half-sample prediction of R. B. Gillespie, M. R. Cutkosky, "Stable user-specific
haptic rendering of the virtual wall", ASME IMECE, DSC-Vol. 58, 397-406, 1996.

F = −K′(x + vT/2) is a spring with the damping K′T/2, so at the port it needs K′T. With the implicit
midpoint rule for the device's mass, K′ = K/(1 + KT²/4m).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class MidpointWall:
    """A wall at x > 0 that only pushes; mass m of the device [kg]."""

    stiffness: float
    mass: float = float("inf")

    def reset(self, dt: float) -> None:
        """Compute the gain."""
        self.dt = dt
        self.gain = self.stiffness / (1.0 + self.stiffness * dt * dt / (4.0 * self.mass))

    def step(self, x: float, v: float) -> float:
        """Return the force on the hand [N]."""
        return -max(self.gain * (x + 0.5 * self.dt * v), 0.0) if x > 0.0 else 0.0

"""The paper's CBuc in front of one rigid wall, e = 0: a spring and damper couples device and tool while
the tool touches or the device is inside; otherwise the tool follows the device.

Section VI of the paper, after J. E. Colgate, M. C. Stanley, J. M. Brown, "Issues in the haptic display of
tool use", IROS 1995, 140-145. `CoupledLoop` runs the same scene in the engine; this is its arithmetic for one
coordinate, a thousand times as fast. A tool that lets go of the device's velocity costs the hand nothing,
so its kinetic energy is a gift.
"""

from __future__ import annotations

from dataclasses import dataclass

TOUCHING = 1e-15  # [m] the rounding of a tool that rests on the wall


@dataclass
class UnilateralWall:
    """A coupler [N/m, N s/m] to a tool [kg] before a wall at x = 0; inside is x > 0."""

    stiffness: float
    damping: float = 0.0
    mass: float = 2.0

    def reset(self, dt: float) -> None:
        """Let go."""
        self.dt = dt
        self.touches = False
        self.begun = False
        self.at = 0.0
        self.rate = 0.0

    def step(self, x: float, v: float) -> float:
        """Return the force on the hand [N]."""
        engaged = self.touches or x > 0.0
        if not (engaged and self.begun):
            self.at = x
            self.rate = v
            self.begun = True
        pull = self.stiffness * (x - self.at) + self.damping * (v - self.rate)
        pull = pull if engaged else 0.0
        free = self.rate + self.dt * pull / self.mass
        pushes = self.at + self.dt * free > 0.0
        self.touches = pushes or self.at >= -TOUCHING
        self.rate = -self.at / self.dt if pushes else free
        self.at += self.dt * self.rate
        return -pull

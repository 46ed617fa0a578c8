"""A wall with the paper's impulses: (20) for one contact, rendered over one period as in (26), then
the penalty (5).

The impulse alone needs (1 + e) m / 2T of the device: at the reversal between two periods the force
jumps by (1 + e) m v / T.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from verification.port.baselines.penalty import PenaltyWall


@dataclass
class ImpulseWall:
    """An impulse when a reading is the first inside the wall, else the penalty wall; also of
    arrays."""

    penalty: PenaltyWall
    mass: float = 2.0
    restitution: float = 0.0

    def reset(self, dt: float) -> None:
        """Begin outside the wall."""
        self.gain = (1.0 + self.restitution) * self.mass / dt
        self.inside: Any = False

    def step(self, x: Any, v: Any) -> Any:
        """Return the force on the hand [N]."""
        new = (x > 0.0) > self.inside
        self.inside = x > 0.0
        return new * -self.gain * (v > 0.0) * v + (1 - new) * self.penalty.step(x, v)

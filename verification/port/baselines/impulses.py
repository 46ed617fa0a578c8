"""A wall with the paper's impulses: (20) for one contact, rendered over one period as in (26), then
the penalty (5).

The impulse alone needs (1 + e) m / 2T of the device: at the reversal between two periods the force
jumps by (1 + e) m v / T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference import Floats
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
        self.inside: bool | NDArray[np.bool_] = False

    def step(self, x: float | Floats, v: float | Floats) -> Floats:
        """Return the force on the hand [N]."""
        new = (x > 0.0) > self.inside
        self.inside = x > 0.0
        return np.where(new, -self.gain * np.maximum(v, 0.0), self.penalty.step(x, v))

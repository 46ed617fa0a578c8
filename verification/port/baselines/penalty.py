"""A wall of spring and damper that only pushes: equation (5) of the paper, clamped.

Its need is KT/2 + B: J. E. Colgate, G. Schenkel, "Passivity of a class of sampled-data systems:
application to haptic interfaces", Journal of Robotic Systems 14(1), 37-47, 1997.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reference import Floats


@dataclass(frozen=True)
class PenaltyWall:
    """F = −max(K x + B v, 0) inside the wall, x > 0 [m]; also of arrays."""

    stiffness: float | Floats
    damping: float | Floats = 0.0

    def step(self, x: float | Floats, v: float | Floats) -> Floats:
        """Return the force on the hand [N]."""
        push = np.maximum(self.stiffness * x + self.damping * v, 0.0)
        return np.where(x > 0.0, -push, 0.0)

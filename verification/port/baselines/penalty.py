"""A wall of spring and damper that only pushes: equation (5) of the paper, clamped.

Its need is KT/2 + B: J. E. Colgate, G. Schenkel, "Passivity of a class of sampled-data systems:
application to haptic interfaces", Journal of Robotic Systems 14(1), 37-47, 1997.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class PenaltyWall:
    """F = −max(K x + B v, 0) inside the wall, x > 0 [m]; also of arrays."""

    stiffness: Any
    damping: Any = 0.0

    def step(self, x: Any, v: Any) -> Any:
        """Return the force on the hand [N]."""
        push = self.stiffness * x + self.damping * v
        return ((x > 0.0) & (push > 0.0)) * -push

"""Time-domain passivity control of a wall: B. Hannaford, J.-H. Ryu, "Time-domain passivity control of
haptic interfaces", IEEE Transactions on Robotics and Automation 18(1), 1-10, 2002.

The observer sums the energy that the held force gave in each period, from the motion that the next
sample shows. If the sum is negative, a damper shall take back what is missing. It acts one period
after the motion that sizes it, so a quick move after a slow one draws more than was missing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass
class PassivityControl:
    """The series controller of Hannaford and Ryu, around a wall with `step(x, v)`.

    most : largest damping of the controller [N s/m].
    """

    wall: Any
    most: float = 20.0

    def reset(self, dt: float) -> None:
        """Forget the energy."""
        self.dt = dt
        self.taken = 0.0
        self.force = 0.0

    def step(self, x: float, v: float) -> float:
        """Return the force on the hand [N]."""
        self.taken -= self.force * v * self.dt
        damping = 0.0
        if self.taken < 0.0 and v != 0.0:
            damping = min(-self.taken / (self.dt * v * v), self.most)
        self.force = self.wall.step(x, v) - damping * v
        return self.force

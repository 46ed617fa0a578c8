"""Couplings between the device and the virtual tool: Fig. 5 and Table I of the paper.

A coupling is data; `iapb.haptics.rendering` computes the forces. With x_t, x_d the coordinates of
tool and device, PD = K (x_d − x_t) + B (ẋ_d − ẋ_t):

- four-channel controller: tool M ẍ_t = F_h + F_env + PD, device M ẍ_d = F_h + F_env,applied − PD;
- unilateral coupler: in contact PD acts on the tool and F_h − PD on the device; in free motion the
  tool follows the device. The coupler stays on while the tool would penetrate a body at the
  device's pose, so that the tool never follows the device into a wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

from iapb.errors import ArgumentError


@dataclass(frozen=True)
class NoCoupling:
    """The hand holds the tool directly; there is no device."""

    name = "none"
    kind = 0
    settings: ClassVar[dict[str, Any]] = {}


@dataclass(frozen=True)
class _PositionCoupling:
    """A PD between device and tool; one stiffness [N/m, N m/rad] and damping [N s/m, ...] per tool
    coordinate."""

    stiffness: tuple[float, ...]
    damping: tuple[float, ...]

    def __post_init__(self) -> None:
        for name, values in (("stiffness", self.stiffness), ("damping", self.damping)):
            good = all(math.isfinite(value) and value >= 0.0 for value in values)
            if not good or len(values) != len(self.stiffness):
                raise ArgumentError(
                    name, values, "one finite value >= 0 for each coordinate of the tool"
                )

    @property
    def settings(self) -> dict[str, Any]:
        """Gains as a run records them."""
        return {"stiffness": list(self.stiffness), "damping": list(self.damping)}


class FourChannel(_PositionCoupling):
    """Four-channel controller: two position channels (PD), two force channels (F_h, F_env)."""

    name = "four-channel"
    kind = 1


class UnilateralCoupler(_PositionCoupling):
    """PD between device and tool while the tool is in contact; apart from it only the hand acts on
    the device."""

    name = "unilateral"
    kind = 2


Coupling = NoCoupling | FourChannel | UnilateralCoupler

"""Couplings between the device and the virtual tool: Fig. 5 and Table I of the paper.

A coupling is data; the forces are in `iapb.haptics.kernels`. With x_t, x_d the coordinates of tool and device,
PD = K (x_d − x_t) + B (ẋ_d − ẋ_t):

- four-channel controller: tool M ẍ_t = F_h + F_env + PD, device M ẍ_d = F_h + F_env,applied − PD;
- unilateral coupler: in contact the tool gets PD and the device F_h − PD; in free motion the tool follows the
  device. It stays on while the device's own pose would penetrate, so that the tool never follows it into a wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from iapb.errors import ArgumentError


@dataclass(frozen=True)
class NoCoupling:
    """The hand holds the tool itself; no device takes part."""

    name = "none"
    kind = 0

    @property
    def settings(self) -> dict[str, Any]:
        """Nothing to set."""
        return {}


@dataclass(frozen=True)
class _PositionCoupling:
    """A PD between device and tool; one stiffness [N/m, N m/rad] and damping [N s/m, ...] per tool coordinate."""

    stiffness: tuple[float, ...]
    damping: tuple[float, ...]

    def __post_init__(self) -> None:
        for name, values in (("stiffness", self.stiffness), ("damping", self.damping)):
            good = all(math.isfinite(value) and value >= 0.0 for value in values)
            if not good or len(values) != len(self.stiffness):
                raise ArgumentError(name, values, "one finite value >= 0 for each coordinate of the tool")

    @property
    def settings(self) -> dict[str, Any]:
        """Gains as they go into a run's record."""
        return {"stiffness": list(self.stiffness), "damping": list(self.damping)}


class FourChannel(_PositionCoupling):
    """Four-channel controller: two position channels (PD), two force channels (F_h, F_env)."""

    name = "four-channel"
    kind = 1


class UnilateralCoupler(_PositionCoupling):
    """PD between device and tool while the tool is in contact; the device feels nothing else but the hand."""

    name = "unilateral"
    kind = 2


Coupling = NoCoupling | FourChannel | UnilateralCoupler

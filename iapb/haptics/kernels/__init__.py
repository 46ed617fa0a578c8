"""The hand's side of one step, compiled: hand force, coupling, rendering, device (paper V-C and VI)."""

from __future__ import annotations

from iapb.haptics.kernels.device import drive_device, move_device, render
from iapb.haptics.kernels.hand import couple
from iapb.haptics.kernels.port import FOUR_CHANNEL, NO_COUPLING, UNILATERAL, Port

__all__ = ["FOUR_CHANNEL", "NO_COUPLING", "UNILATERAL", "Port", "couple", "drive_device", "move_device", "render"]

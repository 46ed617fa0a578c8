"""The hand's port: is a force law passive on a haptic device?

Each name below is loaded at its first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iapb.lazy import lazy_names

if TYPE_CHECKING:
    from verification.port.device import BareDevice as BareDevice
    from verification.port.device import Motion as Motion
    from verification.port.kit import ForceReport as ForceReport
    from verification.port.kit import check_force as check_force
    from verification.port.laws import judge as judge

_HOME = {
    "BareDevice": "verification.port.device",
    "Motion": "verification.port.device",
    "ForceReport": "verification.port.kit",
    "check_force": "verification.port.kit",
    "judge": "verification.port.laws",
}

__getattr__, __dir__, __all__ = lazy_names(__name__, _HOME)

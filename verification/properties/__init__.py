"""What every impact law must keep: one file per law, strategies that draw hard impacts, and the passivity kit."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from verification.properties.bulk import BulkImpacts as BulkImpacts
    from verification.properties.bulk import bulk_impacts as bulk_impacts
    from verification.properties.case import ImpactCase as ImpactCase
    from verification.properties.case import LawResidual as LawResidual
    from verification.properties.kit import check_passivity as check_passivity
    from verification.properties.laws import LAWS as LAWS
    from verification.properties.laws import UNEQUAL_LAWS as UNEQUAL_LAWS
    from verification.properties.passivity_report import PassivityReport as PassivityReport
    from verification.properties.planted_bugs import PLANTED_BUGS as PLANTED_BUGS
    from verification.properties.sound import sound_resolver as sound_resolver

_HOME = {
    "BulkImpacts": "bulk",
    "bulk_impacts": "bulk",
    "ImpactCase": "case",
    "LawResidual": "case",
    "PassivityReport": "passivity_report",
    "check_passivity": "kit",
    "LAWS": "laws",
    "UNEQUAL_LAWS": "laws",
    "PLANTED_BUGS": "planted_bugs",
    "sound_resolver": "sound",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'verification.properties' has no attribute {name!r}")
    value = getattr(import_module(f"verification.properties.{_HOME[name]}"), name)
    globals()[name] = value
    return value

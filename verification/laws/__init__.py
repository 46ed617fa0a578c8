"""Laws of every impact, their tolerances, planted bugs, and the passivity kit that tests any
resolver.

Each name below is loaded at its first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from iapb.lazy import lazy_names

if TYPE_CHECKING:
    from verification.impacts import ImpactCase as ImpactCase
    from verification.laws.bounds import LawResidual as LawResidual
    from verification.laws.contracts import CONTRACTS as CONTRACTS
    from verification.laws.contracts import EXACT_LAWS as EXACT_LAWS
    from verification.laws.contracts import FRICTIONAL_LAWS as FRICTIONAL_LAWS
    from verification.laws.contracts import UNILATERAL_LAWS as UNILATERAL_LAWS
    from verification.laws.equality import LAWS as LAWS
    from verification.laws.equality import UNEQUAL_LAWS as UNEQUAL_LAWS
    from verification.laws.kit import PassivityReport as PassivityReport
    from verification.laws.kit import check_passivity as check_passivity
    from verification.laws.planted import PLANTED_BUGS as PLANTED_BUGS
    from verification.methods import sound_resolver as sound_resolver

_HOME = {
    "ImpactCase": "verification.impacts",
    "LawResidual": "verification.laws.bounds",
    "CONTRACTS": "verification.laws.contracts",
    "EXACT_LAWS": "verification.laws.contracts",
    "FRICTIONAL_LAWS": "verification.laws.contracts",
    "UNILATERAL_LAWS": "verification.laws.contracts",
    "LAWS": "verification.laws.equality",
    "UNEQUAL_LAWS": "verification.laws.equality",
    "PassivityReport": "verification.laws.kit",
    "check_passivity": "verification.laws.kit",
    "PLANTED_BUGS": "verification.laws.planted",
    "sound_resolver": "verification.methods",
}

__getattr__, __dir__, __all__ = lazy_names(__name__, _HOME)

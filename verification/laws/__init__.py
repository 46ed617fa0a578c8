"""Laws of every impact, their tolerances, planted bugs, and the passivity kit that tests any resolver."""

from verification.impacts import ImpactCase
from verification.laws.bounds import LawResidual
from verification.laws.bulk import BulkImpacts, bulk_impacts
from verification.laws.contracts import CONTRACTS, EXACT_LAWS, FRICTIONAL_LAWS, UNILATERAL_LAWS
from verification.laws.equality import LAWS, UNEQUAL_LAWS
from verification.laws.kit import PassivityReport, check_passivity
from verification.laws.planted import PLANTED_BUGS
from verification.laws.resolver import sound_resolver

__all__ = [
    "CONTRACTS",
    "EXACT_LAWS",
    "FRICTIONAL_LAWS",
    "LAWS",
    "PLANTED_BUGS",
    "UNEQUAL_LAWS",
    "UNILATERAL_LAWS",
    "BulkImpacts",
    "ImpactCase",
    "LawResidual",
    "PassivityReport",
    "bulk_impacts",
    "check_passivity",
    "sound_resolver",
]

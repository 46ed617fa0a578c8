"""Laws of every impact, their tolerances, planted bugs, and the passivity kit that tests any
resolver."""

from verification.impacts import ImpactCase as ImpactCase
from verification.laws.bounds import LawResidual as LawResidual
from verification.laws.bulk import BulkImpacts as BulkImpacts
from verification.laws.bulk import bulk_impacts as bulk_impacts
from verification.laws.contracts import CONTRACTS as CONTRACTS
from verification.laws.contracts import EXACT_LAWS as EXACT_LAWS
from verification.laws.contracts import FRICTIONAL_LAWS as FRICTIONAL_LAWS
from verification.laws.contracts import UNILATERAL_LAWS as UNILATERAL_LAWS
from verification.laws.equality import LAWS as LAWS
from verification.laws.equality import UNEQUAL_LAWS as UNEQUAL_LAWS
from verification.laws.kit import PassivityReport as PassivityReport
from verification.laws.kit import check_passivity as check_passivity
from verification.laws.planted import PLANTED_BUGS as PLANTED_BUGS
from verification.laws.resolver import sound_resolver as sound_resolver

"""The claims ledger: each claim of the paper as a computation with a verdict over a range of conditions.

One file per claim. `check_claims` runs them; `CLAIMS` has them by id.
"""

from __future__ import annotations

from importlib import import_module

from verification.claims.claim import Claim
from verification.claims.study import Study, check_claims
from verification.finding import VERDICTS, Column, Finding, Table

_FILES = (
    "c01_one_collision",
    "c02_redundant_collisions",
    "c03_rows_removed",
    "c04_elastic",
    "c05_complementarity",
    "c06_coordinates",
    "c07_plastic",
    "c08_passive",
    "c09_no_impulse",
    "c10_trajectory",
    "c11_forces",
    "c12_saturate_spread",
    "c13_limited_trajectory",
    "c14_limited_forces",
    "c15_settling",
    "c16_together",
    "c17_energy_lost",
    "c18_false_collisions",
    "c19_haptic_rate",
    "c20_damping_bound",
    "c21_impulses_or_damping",
    "c22_cost",
)
CLAIMS: dict[str, Claim] = {
    claim.id: claim for claim in (import_module(f"{__name__}.{file}").CLAIM for file in _FILES)
}

__all__ = ["CLAIMS", "VERDICTS", "Claim", "Column", "Finding", "Study", "Table", "check_claims"]

"""C01: one collision never increases the kinetic energy, and what it takes is a quadratic form (Theorem 1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from verification.claims.algebraic import COLUMNS, summary, within_bound
from verification.claims.claim import Claim
from verification.claims.losses import AS_PRINTED, EXACT, PASSIVE, WITH_HALF, loss_batches
from verification.finding import Table, table_of
from verification.impacts import Family

if TYPE_CHECKING:
    from verification.claims.study import Study

FAMILIES = tuple(Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e2, 1e5, 1e8))
IMPACTS = {"quick": 16, "full": 200}


def measure(study: Study) -> Table:
    """Random impacts at one contact, and some in rationals."""
    return table_of(COLUMNS, loss_batches(study, FAMILIES, IMPACTS[study.depth]))


def finding(table: Table) -> str:
    """One sentence."""
    return (
        f"Relative energy gain {summary(table, PASSIVE)}. The loss is half of the form printed in (18): misfit with "
        f"the ½ {summary(table, WITH_HALF)}, without it {summary(table, AS_PRINTED)}; in rationals the misfit with "
        f"the ½ is {summary(table, EXACT)}."
    )


CLAIM = Claim(
    id="C01",
    statement="One frictionless collision never increases kinetic energy, and the loss is the stated quadratic form.",
    place="Theorem 1, equation (18)",
    quantity="Worst relative energy gain; worst misfit between loss and form, relative to the energy before.",
    tolerance="Gain: 10 d ε √κ(M), the rounding of the velocities returned. Misfit: 100 d ε κ(M), one solve with M. "
    "In rationals: none.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

"""C02: the same for redundant simultaneous collisions (Theorem 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from verification.claims.algebraic import COLUMNS, summary, within_bound
from verification.claims.claim import Claim
from verification.claims.losses import AS_PRINTED, EXACT, PASSIVE, WITH_HALF, loss_batches
from verification.finding import Table, table_of
from verification.impacts import Family

if TYPE_CHECKING:
    from verification.claims.study import Study

FAMILIES = tuple(
    Family(d, contacts, rank, k)
    for d, contacts, rank in ((3, 4, 2), (3, 6, 3), (6, 20, 4), (12, 60, 8))
    for k in (1e2, 1e5)
)
IMPACTS = {"quick": 12, "full": 150}


def measure(study: Study) -> Table:
    """Random impacts at more contacts than are independent, and some in rationals."""
    return table_of(COLUMNS, loss_batches(study, FAMILIES, IMPACTS[study.depth]))


def finding(table: Table) -> str:
    """One sentence."""
    return (
        f"Relative energy gain {summary(table, PASSIVE)}. As in C01 the loss is half of the form printed in (24): "
        f"misfit with the ½ {summary(table, WITH_HALF)}, without it {summary(table, AS_PRINTED)}; in rationals the "
        f"misfit with the ½ is {summary(table, EXACT)}."
    )


CLAIM = Claim(
    id="C02",
    statement="Redundant simultaneous collisions never increase kinetic energy; the loss is the stated quadratic form.",
    place="Theorem 2, equation (24)",
    quantity="Worst relative energy gain; worst misfit between loss and form, relative to the energy before.",
    tolerance="Gain: 10 d ε √κ(M), the rounding of the velocities returned. Misfit: 100 d ε κ(M), one solve with M. "
    "In rationals: none.",
    measure=measure,
    holds=within_bound,
    finding=finding,
)

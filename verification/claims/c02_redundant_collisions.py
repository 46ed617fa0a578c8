"""C02: redundant collisions never increase the kinetic energy; the energy lost is a quadratic form (Theorem 2)."""

from __future__ import annotations

from verification.claims.losses import loss_claim
from verification.impacts import Family

CLAIM = loss_claim(
    "C02", "Redundant simultaneous collisions never increase kinetic energy; the loss is the stated quadratic form.",
    "Theorem 2, equation (24)",
    families=tuple(
        Family(d, contacts, rank, k)
        for d, contacts, rank in ((3, 4, 2), (3, 6, 3), (6, 20, 4), (12, 60, 8)) for k in (1e2, 1e5)
    ),
    impacts={"quick": 12, "full": 150},
)  # fmt: skip

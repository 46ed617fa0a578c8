"""C01: one collision never increases the kinetic energy; the energy lost is a quadratic form (Theorem 1)."""

from __future__ import annotations

from verification.claims.losses import loss_claim
from verification.impacts import Family

CLAIM = loss_claim(
    "C01", "One frictionless collision never increases kinetic energy, and the loss is the stated quadratic form.",
    "Theorem 1, equation (18)",
    families=tuple(Family(d, 1, 1, k) for d in (1, 3, 12) for k in (1e2, 1e5, 1e8)),
    impacts={"quick": 16, "full": 200},
)  # fmt: skip

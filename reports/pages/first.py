"""The outcomes of the claims, counted for the first page and for the last lines of a command."""

from __future__ import annotations

from collections.abc import Sequence

from verification.finding import HOLDS, KINDS, MISPRINTED, Finding


def count_claims(claims: Sequence[Finding]) -> dict[str, int]:
    """Return the number of claims of each kind of outcome, and of those that hold at all."""
    kinds = [claim.kind for claim in claims]
    found = {kind: kinds.count(kind) for kind in KINDS}
    return found | {"all that hold": found[HOLDS] + found[MISPRINTED]}

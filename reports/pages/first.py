"""The outcomes of the claims, counted for the first page and for the last lines of a command."""

from __future__ import annotations

from collections.abc import Sequence

from verification.finding import KINDS, Finding

# What the kinds of outcomes mean to somebody who has not read the ledger; "{s}" is the ending of
# the verb.
COUNTED = dict(
    zip(
        KINDS,
        (
            "hold{s}",
            "hold{s} once a misprint in the formula is corrected",
            "hold{s} in a stated range of conditions",
            "hold{s} for some quantities and fail{s} for others",
            "fail{s}",
            "cannot be decided here",
            "not computed",
        ),
        strict=True,
    )
)


def count_claims(claims: Sequence[Finding]) -> dict[str, tuple[int, str]]:
    """Return the number of claims of each kind of outcome that occurs, and what the kind means, by
    kind."""
    kinds = [claim.kind for claim in claims]
    return {
        kind: (kinds.count(kind), words.format(s="s" if kinds.count(kind) == 1 else ""))
        for kind, words in COUNTED.items()
        if kind in kinds
    }

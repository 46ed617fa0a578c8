"""Stage: every machine-checked statement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def compute(progress: Callable[[int, int], None]) -> tuple[Any, ...]:
    """Check all statements; one ProofRecord each."""
    from verification.proofs import all_proofs, check

    names = all_proofs()
    records = []
    for done, name in enumerate(names):
        progress(done, len(names))
        records.append(check(name))
    progress(len(names), len(names))
    return tuple(records)

"""Stage: every machine-checked statement."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from verification.finding import Failure, attempt
from verification.proofs import all_proofs, check


def compute(progress: Callable[[int, int], None], failures: list[Failure]) -> tuple[Any, ...]:
    """Check all statements; one ProofRecord each, none for one that raises."""
    names = all_proofs()
    records = []
    for done, name in enumerate(names):
        progress(done, len(names))
        records.append(attempt(name, partial(check, name), failures))
    progress(len(names), len(names))
    return tuple(record for record in records if record is not None)

"""The plain records from which the report is built. Every field of Evidence may be empty; an empty
field is printed as "not computed in this run", never as a number.

Findings come unchanged from the studies; the pages use no other data.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from reports.store.uses import StoredFile
from verification.finding import Failure, Finding
from verification.table import Table


@dataclass(frozen=True)
class FailedCases:
    """The cases of a stage that could not be computed, and the file with their tracebacks."""

    stage: str
    failures: tuple[Failure, ...]
    file: str


@dataclass(frozen=True)
class Evidence:
    """Everything that the report may show. `inputs` holds runs, resolved scenes and tables by the
    names that the figures use (`needs` of each recipe)."""

    inputs: Mapping[str, Any] = field(default_factory=dict)
    claims: tuple[Finding, ...] = ()
    # of each scene, as `verification.cost.effects` has them
    effects: Mapping[str, Table] = field(default_factory=dict)
    topics: tuple[Finding, ...] = ()  # the first page has the answer of each, in this order
    # that pages quote, of what is no topic: see `verification.numbers`
    numbers: Mapping[str, Mapping[str, Table]] = field(default_factory=dict)
    failed: tuple[FailedCases, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    runs: tuple[StoredFile, ...] = ()  # that the numbers were computed from
    # that each stage took to compute or read
    seconds: Mapping[str, float] = field(default_factory=dict)

"""What the report is built from: plain records. Every field of Evidence may be empty; an empty one is printed
as "not computed in this run", never as a number.

Findings and proofs come from the studies as they are; the pages know nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from verification.finding import Failure, Finding, Table
from verification.proofs.statement import ProofRecord


@dataclass(frozen=True)
class StoredFile:
    """One line of the manifest: a run or table file, what it holds, and the command that makes it again.

    used_by : the claims, figures' inputs and topics made from a run; nobody for a table
    status : "complete", "partial" where a simulation gave up, "absent" where the file is gone since
    made_on : processor, BLAS kernel and optional code of numpy that computed it, where its file says so
    """

    name: str
    file: str
    key: str
    content_hash: str
    command: str
    size: int | None = None  # bytes
    used_by: tuple[str, ...] = ()
    status: str = "complete"
    made_on: str = ""


@dataclass(frozen=True)
class FailedCases:
    """What could not be computed of a stage, and the file with the tracebacks."""

    stage: str
    failures: tuple[Failure, ...]
    file: str


@dataclass(frozen=True)
class Evidence:
    """Everything the report may show. `inputs` holds runs, resolved scenes and tables by the names that the figures
    ask for (`needs` of each recipe)."""

    inputs: Mapping[str, Any] = field(default_factory=dict)
    scenes: Mapping[str, Any] = field(default_factory=dict)  # resolved scenes by name
    claims: tuple[Finding, ...] = ()
    proofs: tuple[ProofRecord, ...] = ()
    counterexamples: tuple[Finding, ...] = ()  # laws that a resolver or strategy breaks
    hard_cases: tuple[Finding, ...] = ()
    effects: Mapping[str, Table] = field(default_factory=dict)  # of each scene, as `verification.cost.effects` has them
    topics: tuple[Finding, ...] = ()  # the first page has the answer of each, in this order
    failed: tuple[FailedCases, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    manifest: tuple[StoredFile, ...] = ()
    figure_command: str = "iapb reproduce --figure {key}"

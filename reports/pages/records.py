"""What the report is built from: plain records. Every field of Evidence may be empty; an empty one is printed
as "not computed in this run", never as a number.

Whoever computes something turns it into one of these; the pages know nothing else. Formulas are LaTeX without
dollar signs. `outcome` is one of VERDICTS.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from verification.finding import Failure, Finding, Table
from verification.proofs.statement import ProofRecord


@dataclass(frozen=True)
class Verdict:
    """One sentence of the first page; `link` is the id of the section that proves it, `timed` as in Finding."""

    topic: str
    outcome: str
    sentence: str
    link: str = ""
    timed: bool = False


@dataclass(frozen=True)
class Property:
    """A law tried on random and on nasty inputs, and the planted fault that it must catch."""

    law: str
    cases: int
    worst: str
    bound: str
    holds: bool
    fault: str = ""
    fault_caught: bool | None = None


@dataclass(frozen=True)
class Counterexample:
    """The smallest input found that breaks a law.

    who : the resolver or strategy; law : in words; sentence : what happens, with its number
    given : (name, value) of the input and of what came out; test : source to paste, empty where there is none
    """

    who: str
    law: str
    sentence: str
    given: tuple[tuple[str, str], ...]
    test: str = ""


@dataclass(frozen=True)
class HardCase:
    """A named problem with a certain answer.

    kind : "impact", tried with impact methods, or "motion", simulated in worlds
    law : what the answer is, and why it is certain
    numbers : a row per method or world; the first two columns are its name and what came of it
    skipped : why it was not tried; empty where it was
    """

    id: str
    name: str
    source: str
    kind: str
    why_hard: str
    law: str
    expected: str
    numbers: Table
    skipped: str = ""

    @property
    def outcomes(self) -> dict[str, str]:
        """What came of it, by method or world; "stable" where every number is within its bound."""
        return {row["method"]: row["outcome"] for row in self.numbers.records()}


@dataclass(frozen=True)
class StoredFile:
    """One line of the manifest: a run or table file, what it holds, and the command that makes it again.

    used_by : the claims, figures' inputs and topics made from a run; nobody for a table
    status : "complete", "partial" where a simulation gave up, "absent" where the file is gone since
    made_on : processor and BLAS kernel that computed it, where its file says so
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
    verdicts: tuple[Verdict, ...] = ()
    claims: tuple[Finding, ...] = ()
    proofs: tuple[ProofRecord, ...] = ()
    properties: tuple[Property, ...] = ()
    counterexamples: tuple[Counterexample, ...] = ()
    hard_cases: tuple[HardCase, ...] = ()
    bulk: Table | None = None  # energy gains of very many impacts, a row per method and decade of κ(M)
    effects: Mapping[str, Table] = field(default_factory=dict)  # of each scene, as `verification.cost.effects` has them
    topics: tuple[Finding, ...] = ()
    failed: tuple[FailedCases, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict)
    manifest: tuple[StoredFile, ...] = ()
    figure_command: str = "iapb reproduce --figure {key}"

"""The sections of the report in reading order: one template each, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from reports.pages.records import Evidence


@dataclass(frozen=True)
class Section:
    """`ready` tells whether there is something to show; otherwise the page says that it was not computed."""

    id: str
    title: str
    ready: Callable[[Evidence], bool]

    @property
    def template(self) -> str:
        return f"{self.id}.html.j2"


def _always(_: Evidence) -> bool:
    return True


SECTIONS: tuple[Section, ...] = (
    Section("idea", "The idea", _always),
    Section("claims", "Claims ledger", lambda evidence: bool(evidence.claims)),
    Section("figures", "Figures of the paper", _always),
    Section("couplings", "Device and tool", _always),
    Section("proofs", "Proofs", lambda evidence: bool(evidence.proofs)),
    Section("properties", "Properties", lambda evidence: bool(evidence.properties)),
    Section("cross-checks", "Cross-checks", lambda evidence: bool(evidence.cross_checks)),
    Section("accuracy", "Accuracy against time", _always),
    Section("hard-cases", "Hard cases", lambda evidence: bool(evidence.hard_cases)),
    Section("effects", "Effects", lambda evidence: bool(evidence.effects)),
    Section("provenance", "Provenance", lambda evidence: bool(evidence.provenance)),
    Section("manifest", "Manifest", lambda evidence: bool(evidence.manifest)),
)

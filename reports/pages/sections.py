"""The sections of the report in reading order: one template each, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from reports.pages.records import Evidence


@dataclass(frozen=True)
class Section:
    """`ready` tells whether there is something to show; otherwise the page says that it was not computed.

    tables : names of the manifest's tables that its numbers are kept in
    """

    id: str
    title: str
    ready: Callable[[Evidence], bool]
    topic: bool = False  # drawn from a Finding, by the template that all of them share
    tables: tuple[str, ...] = ()

    @property
    def template(self) -> str:
        return "topic.html.j2" if self.topic else f"{self.id}.html.j2"


def _always(_: Evidence) -> bool:
    return True


def _has(key: str) -> Callable[[Evidence], bool]:
    return lambda evidence: any(topic.key == key for topic in evidence.topics)


def _topic(id: str, title: str) -> Section:
    return Section(id, title, _has(id), True, (id,))


SECTIONS: tuple[Section, ...] = (
    Section("idea", "The idea", _always),
    Section("claims", "Claims ledger", lambda evidence: bool(evidence.claims), tables=("claims",)),
    Section("figures", "Figures of the paper", _always, tables=("runs of the figures",)),
    Section("couplings", "Device and tool", _always),
    Section("proofs", "Proofs", lambda evidence: bool(evidence.proofs), tables=("proofs",)),
    Section("properties", "Properties", _has("properties"), tables=("properties", "counterexamples", "energy-gains")),
    _topic("exact-energy", "Exact energy"),
    _topic("cross-checks", "Cross-checks"),
    _topic("mechanics", "Linkages and free bodies"),
    _topic("scene-ledger", "The scenes"),
    _topic("complementarity", "Against complementarity"),
    Section("accuracy", "Accuracy against time", _always, tables=("accuracy",)),
    Section("hard-cases", "Hard cases", lambda evidence: bool(evidence.hard_cases), tables=("hard cases",)),
    _topic("stability", "Stability of contact"),
    _topic("engines", "Other engines"),
    _topic("haptic-rate", "The haptic rate"),
    Section("effects", "Effects", lambda evidence: bool(evidence.effects), tables=("effects",)),
    _topic("survival", "Runs that survive"),
    Section("provenance", "Provenance", lambda evidence: bool(evidence.provenance)),
    Section("manifest", "Manifest", lambda evidence: bool(evidence.manifest)),
)

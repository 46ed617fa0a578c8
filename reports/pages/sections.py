"""The sections of the report in reading order, in five groups; each has one template, one page and one line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from reports.pages.records import Evidence


@dataclass(frozen=True)
class Section:
    """A section. `ready` returns whether there is evidence to show; if not, the page says that it was not computed.

    group : heading in the contents
    tables : names of the manifest's tables that store the section's numbers
    """

    group: str
    id: str
    title: str
    ready: Callable[[Evidence], bool]
    topic: bool = False  # drawn from a Finding, by the template that all of them share
    tables: tuple[str, ...] = ()

    @property
    def page(self) -> str:
        """Return the path of the section's file, relative to the folder of the report."""
        return f"report/{self.id}.html"

    @property
    def template(self) -> str:
        return "topic.html.j2" if self.topic else f"{self.id}.html.j2"


def _always(_: Evidence) -> bool:
    return True


def _has(key: str) -> Callable[[Evidence], bool]:
    return lambda evidence: any(topic.key == key for topic in evidence.topics)


def _topic(group: str, id: str, title: str) -> Section:
    return Section(group, id, title, _has(id), True, (id,))


PAPER, ENERGY, CHECKS, TIME, DATA = "The paper", "Energy", "Is it right?", "Time and effects", "Make it again"
SECTIONS: tuple[Section, ...] = (
    Section(PAPER, "idea", "The idea", _always),
    Section(PAPER, "claims", "Claims ledger", lambda evidence: bool(evidence.claims),
            tables=("claims", "claims on the peg", "claims on times")),
    Section(PAPER, "figures", "Figures of the paper", _always, tables=("runs of the figures",)),
    Section(PAPER, "couplings", "Device and tool", _always),
    Section(ENERGY, "proofs", "Proofs", lambda evidence: bool(evidence.proofs), tables=("proofs",)),
    Section(ENERGY, "properties", "Properties", _has("properties"),
            tables=("properties", "counterexamples", "energy-gains")),
    _topic(ENERGY, "exact-energy", "Exact energy"),
    _topic(CHECKS, "mechanics", "Linkages and free bodies"),
    _topic(CHECKS, "scene-ledger", "The scenes"),
    _topic(CHECKS, "complementarity", "Against complementarity"),
    Section(CHECKS, "hard-cases", "Hard cases", lambda evidence: bool(evidence.hard_cases), tables=("hard cases",)),
    _topic(CHECKS, "stability", "Stability of contact"),
    _topic(CHECKS, "engines", "Other engines"),
    Section(TIME, "accuracy", "Accuracy against time", _always, tables=("accuracy",)),
    _topic(TIME, "haptic-rate", "The haptic rate"),
    Section(TIME, "effects", "Effects", lambda evidence: bool(evidence.effects), tables=("effects",)),
    _topic(DATA, "survival", "Runs that survive"),
    Section(DATA, "provenance", "Provenance", lambda evidence: bool(evidence.provenance)),
    Section(DATA, "manifest", "Manifest", lambda evidence: bool(evidence.manifest)),
)

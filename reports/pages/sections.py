"""The sections of the report in reading order, in five groups; each has one template, one page and
one line here."""

from __future__ import annotations

from dataclasses import dataclass

from reports.pages.records import Evidence


@dataclass(frozen=True)
class Section:
    """A section.

    group : heading in the contents
    needs : field of Evidence, or key of a topic, without which the page says that it was not
        computed
    stages : stages of the evidence whose failed cases the section lists
    topic : whether it is drawn from a Finding, by the template that all of them share
    """

    group: str
    id: str
    title: str
    needs: str = ""
    stages: tuple[str, ...] = ()
    topic: bool = False

    @property
    def page(self) -> str:
        """Return the path of the section's file, relative to the folder of the report."""
        return f"report/{self.id}.html"

    @property
    def template(self) -> str:
        return "topic.html.j2" if self.topic else f"{self.id}.html.j2"

    def ready(self, evidence: Evidence) -> bool:
        """Return whether there is evidence to show."""
        return (
            not self.needs
            or bool(getattr(evidence, self.needs, ()))
            or any(topic.key == self.needs for topic in evidence.topics)
        )


def _topic(group: str, id: str, title: str) -> Section:
    return Section(group, id, title, id, (id,), topic=True)


PAPER, ENERGY, CHECKS, TIME, DATA = (
    "The paper",
    "Energy",
    "Is it right?",
    "Time and effects",
    "Make it again",
)
SECTIONS: tuple[Section, ...] = (
    Section(PAPER, "idea", "The idea"),
    Section(
        PAPER,
        "claims",
        "Claims ledger",
        "claims",
        ("claims", "claims on the peg", "claims on times"),
    ),
    Section(PAPER, "figures", "Figures of the paper", "", ("runs of the figures",)),
    Section(PAPER, "couplings", "Device and tool"),
    Section(ENERGY, "proofs", "Proofs", "proofs", ("proofs",)),
    Section(
        ENERGY,
        "properties",
        "Properties",
        "properties",
        ("properties", "counterexamples", "energy-gains"),
    ),
    _topic(ENERGY, "exact-energy", "Exact energy"),
    _topic(CHECKS, "mechanics", "Linkages and free bodies"),
    _topic(CHECKS, "scene-ledger", "The scenes"),
    _topic(CHECKS, "complementarity", "Against complementarity"),
    Section(CHECKS, "hard-cases", "Hard cases", "hard_cases", ("hard cases",)),
    _topic(CHECKS, "stability", "Stability of contact"),
    _topic(CHECKS, "engines", "Other engines"),
    Section(TIME, "accuracy", "Accuracy against time", "", ("accuracy",)),
    _topic(TIME, "haptic-rate", "The haptic rate"),
    Section(TIME, "effects", "Effects", "effects", ("effects",)),
    _topic(DATA, "survival", "Runs that repeat"),
    Section(DATA, "provenance", "Provenance", "provenance"),
)

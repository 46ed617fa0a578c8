"""Quantities that several pages quote: one value and one verdict each, compared on the findings before rendering.

A Part or Finding names the quantities in its sentence, and its sentence contains their values (`verification.finding`);
nothing here recognises words.
"""

from __future__ import annotations

from reports.pages.records import Evidence
from verification.finding import QUANTITIES, Finding, Part

PEG_STEP = "peg_corner"  # the scene whose time of a step is shown


def peg_step(evidence: Evidence) -> str:
    """Return the time of a step of the representative scene, "" if it was not measured."""
    table = evidence.inputs.get("effect_steps")
    times = table.where(scene=PEG_STEP).column("step") if table is not None and table.rows else []
    return f"{times[0]:.2g} µs" if times else ""


def quoted(evidence: Evidence) -> dict[str, set[str]]:
    """Return all values of each quantity that the report quotes and, below ``verdict on NAME``, all its verdicts.

    The verdict on a quantity in a sentence of a part is that of the part. In an answer, it is the verdict of the part
    that has the quantity, or that of the finding if no part has it.
    """
    said: dict[str, set[str]] = {"time of a peg step": {step}} if (step := peg_step(evidence)) else {}
    for finding in (*evidence.claims, *evidence.topics):
        judged = {name for part in finding.parts for name, _ in part.quantities}
        sentences: tuple[Finding | Part, ...] = (finding, *finding.parts)
        for one in sentences:
            for name, value in one.quantities:
                said.setdefault(name, set()).add(value)
                if one is not finding or name not in judged:
                    said.setdefault(f"verdict on {name}", set()).add(one.verdict)
    return said


def contradictions(evidence: Evidence) -> dict[str, tuple[str, ...]]:
    """Return the quantities for which the report gives different values or verdicts, with all of these."""
    return {name: tuple(sorted(texts)) for name, texts in quoted(evidence).items() if len(texts) > 1}


def unsaid(evidence: Evidence) -> tuple[str, ...]:
    """Return the quantities that the report does not quote, so that `contradictions` does not check them."""
    said = quoted(evidence)
    return tuple(name for name in QUANTITIES if name not in said)

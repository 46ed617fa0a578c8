"""One quantity has one number: what the studies say is recognised, and two texts for one name are noticed."""

from __future__ import annotations

import pytest

from reports.commands.reproduce import print_contradictions
from reports.evidence import exact_energy
from reports.pages.builder import build_report
from reports.pages.formulas import prose
from reports.pages.quantities import QUANTITIES, contradictions
from reports.pages.records import Evidence
from verification.finding import REPRODUCED, Finding, Part, finding_of
from verification.hard_cases.study import on_hard_cases

SENTENCES = {
    "impacts certified": ("0 of 10,846 impacts in 1,192 runs of the engine gained energy", "10,846"),
    "adverse impacts certified": ("nor did 120,000 random impacts drawn to provoke a gain", "120,000"),
    "time of a peg step": ("as long as one of peg_corner (0.8 µs on this machine)", "0.8 µs"),
    "exponent of bodies": ("the time of a step of free bodies grows with exponent 1.24.", "1.24"),
    "hard cases of the engine": ("The engine is stable on 50 of 51 hard cases", "50 of 51"),
    "speed targets": ("14 of 18 speed targets met", "14 of 18"),
}  # fmt: skip


def test_every_quantity_is_marked_in_a_sentence() -> None:
    assert set(SENTENCES) == set(QUANTITIES)
    for name, (sentence, value) in SENTENCES.items():
        assert f'<data value="{name}">{value}</data>' in prose(sentence)


def test_a_peg_step_with_two_times_and_an_exponent_with_two_values_are_noticed() -> None:
    """As the report had them: 0.44 and 0.59 µs, 1.29 and 1.24."""

    def topic(key: str, *said: str) -> Finding:
        return finding_of(key, key, "", said[0], [Part(sentence, REPRODUCED) for sentence in said])

    first = "A step of the peg in the corner takes 0.44 µs."
    other = "One step of peg_corner, compiled: 0.59 µs."
    bodies = [f"200 bodies: the exponent of the time is {value}." for value in ("1.29", "1.24")]
    told = Evidence(topics=(topic("mechanics", first, bodies[0]), topic("haptic-rate", other, bodies[1])))
    found = contradictions(build_report(told, ()))
    assert found == {"time of a peg step": ("0.44 µs", "0.59 µs"), "exponent of bodies": ("1.24", "1.29")}
    alone = Evidence(topics=(topic("mechanics", first), topic("haptic-rate", first)))
    assert contradictions(build_report(alone, ())) == {}


def test_the_studies_say_their_quantities_as_they_are_recognised() -> None:
    assert "stable on 0 of 0 hard cases" in on_hard_cases(()).answer
    source = exact_energy.__loader__.get_source(exact_energy.__name__)  # type: ignore[union-attr]
    assert "impacts in {len(rows):,} runs of the engine" in source and "drawn to provoke a gain" in source


def test_a_contradiction_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert print_contradictions({"report.html": '<data value="n">1</data> <data value="n">2</data>'})
    assert "n: 1, 2" in capsys.readouterr().out
    assert not print_contradictions({"report.html": '<data value="n">1</data> <data value="n">1</data>'})
    assert capsys.readouterr().out == ""

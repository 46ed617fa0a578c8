"""One quantity has one value and one verdict in a report, on whatever pages it stands."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iapb.errors import ArgumentError
from reports.commands.reproduce import print_contradictions
from reports.pages.builder import FIRST_PAGE, build_report
from reports.pages.quantities import contradictions, unsaid
from reports.pages.records import Evidence
from verification.finding import MIXED, QUANTITIES, REPRODUCED, Finding, Part, finding_of
from verification.table import Column, table_of

BODIES = "exponent of bodies"


def topic(key: str, verdict: str, said: str, name: str, value: str) -> Finding:
    """A topic of one sentence with one quantity, which its answer repeats."""
    given = ((name, value),)
    return finding_of(key, key, "", said, [Part(said, verdict, quantities=given)], quantities=given)


def growth(key: str, value: str = "1.24", verdict: str = MIXED) -> Finding:
    return topic(key, verdict, f"Time of a step grows as the number of bodies to {value}.", BODIES, value)


TOLD = Evidence(topics=(growth("mechanics"), growth("haptic-rate"), growth("engines")))


def test_a_second_value_or_verdict_of_any_finding_is_noticed() -> None:
    assert contradictions(TOLD) == {}
    for k, finding in enumerate(TOLD.topics):
        for other, found in ((growth(finding.key, "1.29"), {BODIES: ("1.24", "1.29")}),
                             (growth(finding.key, verdict=REPRODUCED),
                              {f"verdict on {BODIES}": ("mixed", "reproduced")})):
            topics = (*TOLD.topics[:k], other, *TOLD.topics[k + 1 :])
            assert contradictions(Evidence(topics=topics)) == found
            assert contradictions(Evidence(topics=topics[1:], claims=topics[:1])) == found


def test_an_answer_and_its_part_that_differ_are_noticed_and_an_answer_alone_has_its_own_verdict() -> None:
    said = growth("mechanics")
    answered = replace(said, answer="To 1.29.", quantities=((BODIES, "1.29"),))
    assert contradictions(Evidence(topics=(answered,))) == {BODIES: ("1.24", "1.29")}
    alone = replace(said, parts=(Part("s.", REPRODUCED),), verdict=REPRODUCED)
    assert contradictions(Evidence(topics=(said, alone))) == {f"verdict on {BODIES}": ("mixed", "reproduced")}


def test_a_quantity_is_part_of_its_sentence() -> None:
    for said in ("Bodies: 1.24.", "It grows with the power 1.24; of 11.24 and 1.245 nothing is said."):
        assert Part(said, MIXED, quantities=((BODIES, "1.24"),)).sentence == said
    with pytest.raises(ArgumentError, match="is part of"):
        Part("Bodies: 1.29.", MIXED, quantities=((BODIES, "1.24"),))
    with pytest.raises(ArgumentError, match="is part of"):
        finding_of("k", "k", "", "Bodies: 11.24, 1.245 and 1324.", [], quantities=((BODIES, "1.24"),))
    with pytest.raises(ArgumentError, match="exponent of bodies"):
        Part("1", MIXED, quantities=(("exponent of bodys", "1"),))


def test_a_quantity_that_is_not_quoted_is_named_and_the_time_of_a_step_is_on_the_first_page() -> None:
    assert set(unsaid(TOLD)) == set(QUANTITIES) - {BODIES}
    steps = table_of((Column("scene"), Column("step", "µs")), [{"scene": "peg_corner", "step": 0.4444}])
    rate = topic("haptic-rate", MIXED, "14 of 18 speed targets met.", "speed targets", "14 of 18")
    evidence = Evidence(topics=(rate,), inputs={"effect_steps": steps})
    assert set(unsaid(evidence)) == set(QUANTITIES) - {"time of a peg step", "speed targets"}
    assert "A step of peg_corner takes 0.44 µs. 14 of 18" in build_report(evidence, ())[FIRST_PAGE]


def test_a_contradiction_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert print_contradictions(Evidence(topics=(growth("a"), growth("b", "1.29"))))
    assert f"{BODIES}: 1.24, 1.29" in capsys.readouterr().out
    assert not print_contradictions(TOLD) and capsys.readouterr().out == ""

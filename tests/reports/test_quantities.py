"""One quantity has one value and one verdict in a report, on whatever pages it stands."""

from __future__ import annotations

import re

import pytest

from iapb.errors import ArgumentError
from reports.commands.reproduce import print_contradictions
from reports.pages.builder import FIRST_PAGE, build_report
from reports.pages.formulas import prose
from reports.pages.quantities import Mark, contradictions, marks, unsaid
from reports.pages.records import Evidence
from verification.finding import (
    MIXED,
    QUANTITIES,
    REFUTED,
    REPRODUCED,
    Column,
    Finding,
    Part,
    finding_of,
    table_of,
)

BODIES = "exponent of bodies"


def topic(key: str, verdict: str, said: str, name: str, value: str) -> Finding:
    """A topic of one sentence with one quantity, which its answer repeats."""
    given = ((name, value),)
    return finding_of(key, key, "", said, [Part(said, verdict, quantities=given)], quantities=given)


def growth(key: str, value: str = "1.24", verdict: str = MIXED) -> Finding:
    return topic(key, verdict, f"Time of a step grows as the number of bodies to {value}.", BODIES, value)


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    """The first page and three others, all of which say one quantity, and a claim with its parts."""
    claim = finding_of("C01", "C01", "does it hold?", "It holds.", [Part("s.", REPRODUCED, "straight")])
    told = (growth("mechanics"), growth("haptic-rate"), growth("engines"))
    return build_report(Evidence(topics=told, claims=(claim,)), ())


def saying(pages: dict[str, str], name: str) -> list[str]:
    return [page for page, text in pages.items() if f'<data value="{name}"' in text]


def test_a_second_value_is_noticed_on_any_page(pages: dict[str, str]) -> None:
    assert contradictions(pages) == {}
    assert len(saying(pages, BODIES)) == 4 and FIRST_PAGE in saying(pages, BODIES)
    for page in saying(pages, BODIES):
        planted = pages | {page: pages[page].replace(">1.24</data>", ">1.29</data>", 1)}
        assert contradictions(planted) == {BODIES: ("1.24", "1.29")}, page


def test_a_second_verdict_is_noticed_on_any_page(pages: dict[str, str]) -> None:
    for page in saying(pages, BODIES):
        said = f'<data value="{BODIES}" data-verdict="mixed">'
        assert said in pages[page], page
        planted = pages | {page: pages[page].replace(said, said.replace("mixed", "reproduced"), 1)}
        assert contradictions(planted) == {f"verdict on {BODIES}": ("mixed", "reproduced")}, page


@pytest.mark.parametrize("whose", ["mechanics", "haptic-rate", "engines", "C01", "C01, straight"])
def test_a_second_verdict_on_a_finding_or_its_part_is_noticed(pages: dict[str, str], whose: str) -> None:
    own = re.compile(rf'data-of="{whose}" data-verdict="[^"]+"')
    at = [page for page, text in pages.items() if own.search(text)]
    assert len(at) == 2  # the first page, and its own
    for page in at:
        planted = pages | {page: own.sub(f'data-of="{whose}" data-verdict="{REFUTED}"', pages[page])}
        assert list(contradictions(planted)) == [f"verdict on {whose}"]


def test_two_studies_that_differ_are_noticed() -> None:
    """As the report had it: 1.29 with a tick, 1.24 with "within limits"."""
    told = Evidence(topics=(growth("mechanics", "1.29", REPRODUCED), growth("haptic-rate")))
    assert contradictions(build_report(told, ())) == {
        BODIES: ("1.24", "1.29"), f"verdict on {BODIES}": ("mixed", "reproduced")}  # fmt: skip


def test_the_value_is_marked_whatever_the_words(pages: dict[str, str]) -> None:
    """A sentence that is worded anew keeps its mark; one that no longer says the value cannot be made."""
    for said in ("Bodies: 1.24.", "It grows with the power 1.24; of 11.24 and 1.245 nothing is said."):
        part = Part(said, MIXED, quantities=((BODIES, "1.24"),))
        assert prose(part.sentence, marks(part)).count(f'<data value="{BODIES}" data-verdict="mixed">1.24</data>') == 1
    with pytest.raises(ArgumentError, match="is part of"):
        Part("Bodies: 1.29.", MIXED, quantities=((BODIES, "1.24"),))
    with pytest.raises(ArgumentError, match="is part of"):
        finding_of("k", "k", "", "Bodies: 11.24, 1.245 and 1324.", [], quantities=((BODIES, "1.24"),))
    with pytest.raises(ArgumentError, match="exponent of bodies"):
        Part("1", MIXED, quantities=(("exponent of bodys", "1"),))


def test_a_quantity_that_no_page_says_is_named(pages: dict[str, str]) -> None:
    assert set(unsaid(pages)) == set(QUANTITIES) - {BODIES}
    assert unsaid({"page": "".join(f'<data value="{name}">1</data>' for name in QUANTITIES)}) == ()


def test_the_time_of_a_step_on_the_first_page_is_marked() -> None:
    steps = table_of((Column("scene"), Column("step", "µs")), [{"scene": "peg_corner", "step": 0.4444}])
    rate = topic("haptic-rate", MIXED, "14 of 18 speed targets met.", "speed targets", "14 of 18")
    first = build_report(Evidence(topics=(rate,), inputs={"effect_steps": steps}), ())[FIRST_PAGE]
    assert '<data value="time of a peg step">0.44 µs</data>' in first
    assert first.count('<data value="speed targets" data-verdict="mixed">14 of 18</data>') == 2


def test_a_contradiction_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert print_contradictions({"report.html": '<data value="n">1</data> <data value="n">2</data>'})
    assert "n: 1, 2" in capsys.readouterr().out
    assert not print_contradictions({"report.html": '<data value="n">1</data> <data value="n">1</data>'})
    assert capsys.readouterr().out == ""
    assert prose("1 of 2", (Mark("n", "1"),)) == '<data value="n">1</data> of 2'

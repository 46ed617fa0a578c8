"""What the first page says first: sentences made from findings, and nothing about what was not computed."""

from __future__ import annotations

from dataclasses import replace

from reports.pages.first import LIMIT, MISSES_SHOWN, Answer, answer, facts
from reports.pages.records import Evidence
from verification.claims.peg import LARGE
from verification.finding import MIXED, NOT_COMPUTED, REFUTED, REPRODUCED, WHERE, Finding, Part, finding_of
from verification.region import Region
from verification.table import titled

ROWS = ((LARGE, "x", 10.0, 1.0), (LARGE, "y", 6.0, 2.0), (LARGE, "x", 8.0, 1.0), (LARGE, "theta", 1.0, 1.0),
        ("other", "x", 99.0, 1.0))  # fmt: skip
FORCES = finding_of("C11", "C11", "", "", (Part("p.", REPRODUCED),),
                    {"C11": titled(("part", "coordinate", "IAPB", "PB"), ROWS)})
NEAR_FLAT = Region((("tilt", "rad", None, 0.015),), share=0.05)
WIDER = Region((("tilt", "rad", None, 0.03),), share=0.1)
PARTS = (Part("s.", WHERE, "x, on the full grid", 9, 40, region=NEAR_FLAT), Part("s.", REFUTED, "theta, there", 1, 40),
         Part("s.", WHERE, "y, on the full grid", 12, 40, region=WIDER))  # fmt: skip
PATH = finding_of("C10", "C10", "", "", PARTS)


def topic(key: str, title: str, verdict: str, miss: str = "") -> Finding:
    return finding_of(key, title, "", f"answer of {key}", (Part("p.", verdict), Part("q.", verdict, miss=miss)))


def test_the_answer_is_made_from_the_claims() -> None:
    said = answer(Evidence(claims=(PATH, FORCES)))
    assert "8 times as large" in said.holds and "median of 3 cases" in said.holds  # 10, 3 and 8
    assert "a tilt of at most 0.9°" in said.holds and "gained" not in said.holds
    assert "For larger tilts" in said.fails and "In rotation, the path with impulses is usually not" in said.fails


def test_without_a_region_the_answer_says_that_there_is_none() -> None:
    parts = tuple(replace(part, region=None, verdict=REPRODUCED) for part in PATH.parts)
    said = answer(Evidence(claims=(replace(PATH, parts=parts),)))
    assert said.fails.startswith("In no range of starts") and "rotation" not in said.fails and said.holds == ""


def test_nothing_is_said_of_what_was_not_computed() -> None:
    assert answer(Evidence()) == Answer("", "") and facts(Evidence()) == ()


def test_the_facts_name_our_own_misses() -> None:
    topics = (topic("exact-energy", "Energy", REPRODUCED), topic("engines", "Engines", MIXED, "a stack moves"),
              topic("haptic-rate", "The haptic rate", NOT_COMPUTED))
    made = {"commit": "c" * 40, "cpu": "P"}
    found = {fact.label: fact for fact in facts(Evidence(topics=topics, provenance=made))}
    said = {label: fact.text for label, fact in found.items()}
    assert answer(Evidence(topics=topics)).holds == "No impact of the engine ever gained energy."
    assert said["Is it safe?"] == f"answer of exact-energy {LIMIT}" and "Is it fast?" not in said
    assert found["What we miss"].items == (("A stack moves", "engines"),)
    assert said["What we miss"] == "Not computed: The haptic rate."
    assert said["Made from"] == "commit cccccccccccc, P" and "Errors in the paper" not in said
    assert "Every finding of ours holds." in {fact.text for fact in facts(Evidence(topics=topics[:1]))}


def test_the_gravest_misses_come_first_and_the_rest_are_counted() -> None:
    """What gains energy before what is slow, whatever the order of the topics; no clause: the title."""
    given = ("haptic-rate", "mechanics", "stability", "complementarity", "engines", "hard-cases", "exact-energy")
    topics = tuple(topic(key, f"Title of {key}", REFUTED if key == "hard-cases" else MIXED,
                         "" if key == "engines" else f"miss of {key}") for key in given)
    (fact,) = (fact for fact in facts(Evidence(topics=topics)) if fact.label == "What we miss")
    assert len(fact.items) == MISSES_SHOWN + 1
    assert fact.items[:3] == (("Miss of exact-energy", "exact-energy"), ("Miss of hard-cases", "hard-cases"),
                              ("Title of engines: mixed", "engines"))  # fmt: skip
    assert fact.items[-1] == ("and 2 more", "asked") and fact.text == ""
    slow = finding_of("haptic-rate", "t", "", "a", [Part("p.", MIXED, miss=f"{n} is slow") for n in "abc"])
    (fact,) = facts(Evidence(topics=(slow,)))[-1:]
    assert fact.items == (("A is slow, and 2 more", "haptic-rate"),)  # a line each, however much a topic misses

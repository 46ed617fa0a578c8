"""Cases that fail are counted, named, and never hold."""

from __future__ import annotations

from verification.finding import NOT_COMPUTED, REPRODUCED, Failure, Part, attempt, finding_of, with_failures

TOPIC = finding_of("engines", "Other engines", "", "All well.", (Part("all well", REPRODUCED),))


def test_a_topic_says_what_failed_and_no_longer_holds_as_a_whole() -> None:
    failures: list[Failure] = []
    assert attempt("two discs", lambda: 1 // 0, failures) is None
    assert attempt("one disc", lambda: 1, failures) == 1
    topic = with_failures(TOPIC, failures)
    assert topic.tables["not computed"].rows == (
        ("two discs", "ZeroDivisionError", "integer division or modulo by zero"),
    )
    assert topic.answer == "All well. 1 case failed." and topic.failures == tuple(failures)
    assert topic.parts[-1].verdict == NOT_COMPUTED and "two discs" in topic.parts[-1].sentence
    assert topic.verdict == NOT_COMPUTED


def test_without_failures_nothing_changes() -> None:
    assert with_failures(TOPIC, ()) is TOPIC
    assert TOPIC.verdict == REPRODUCED

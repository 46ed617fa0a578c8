"""Cases that fail are counted, named, and never hold."""

from __future__ import annotations

from reports.evidence.verdicts import verdicts
from reports.pages.records import Evidence, Finding, Topic, with_failures
from verification.finding import NOT_COMPUTED, REPRODUCED, Failure, attempt

TOPIC = Topic("engines", "Other engines", "", (Finding("all well", REPRODUCED),), verdict="All well.")


def test_a_topic_says_what_failed_and_no_longer_holds_as_a_whole() -> None:
    failures: list[Failure] = []
    assert attempt("two discs", lambda: 1 // 0, failures) is None
    assert attempt("one disc", lambda: 1, failures) == 1
    topic = with_failures(TOPIC, failures)
    assert topic.tables["not computed"].rows == (
        ("two discs", "ZeroDivisionError", "integer division or modulo by zero"),
    )
    assert topic.verdict == "All well. 1 case failed." and topic.failures == tuple(failures)
    assert topic.findings[-1].outcome == NOT_COMPUTED and "two discs" in topic.findings[-1].sentence
    assert [verdict.outcome for verdict in verdicts(Evidence(topics=(topic,)))] == [NOT_COMPUTED]


def test_without_failures_nothing_changes() -> None:
    assert with_failures(TOPIC, ()) is TOPIC
    assert [verdict.outcome for verdict in verdicts(Evidence(topics=(TOPIC,)))] == [REPRODUCED]

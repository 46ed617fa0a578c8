"""The runner: a fault costs its row, its sentence or its table alone; columns follow from the rows;
topics conclude."""

import pytest

from iapb.errors import ArgumentError
from verification.check import Check, Study, Topic
from verification.finding import (
    NOT_COMPUTED,
    REFUTED,
    REPRODUCED,
    Part,
)
from verification.table import Column, Columns


def row(study, case):
    if case == "broken":
        raise ZeroDivisionError("planted")
    return {"case": case, "size [m]": len(case)}


def a_check(key="sizes", cases=("a", "bb", "broken"), **options):
    options = {"question": "Cases are short.", "holds": lambda row: row["size"] < 3} | options
    chosen = cases if callable(cases) else lambda study: cases
    return Check(key=key, cases=chosen, row=row, **options)


def concluded(*checks, numbers=None):
    progress = []
    topic = Topic(key="topic", title="Topic", question="?", checks=checks, numbers=numbers)
    found = topic(lambda *_: None, "quick", lambda *done: progress.append(done))
    assert progress == [(done, len(checks)) for done in range(len(checks) + 1)]
    return found


def test_a_case_that_raises_costs_its_row_alone():
    found = concluded(a_check())
    assert found.tables["sizes"].rows == (("a", 1), ("bb", 2)) and found.verdict == NOT_COMPUTED
    assert [(one.case, one.error) for one in found.failures] == [
        ("sizes, broken", "ZeroDivisionError")
    ]
    part = found.parts[0]
    assert (part.name, part.verdict, part.held, part.decided) == (
        "Cases are short.",
        REPRODUCED,
        2,
        2,
    )


def test_a_target_a_check_or_the_numbers_that_raise_cost_themselves_alone():
    found = concluded(
        a_check(cases=("a",), targets=lambda table: table.nothing),
        a_check("second", cases=None),
        a_check("third", cases=("ccc",)),
        numbers=lambda tables: tables["second"],
    )
    assert [one.case for one in found.failures] == [
        "second, all of it",
        "sizes, its parts",
        "the numbers",
    ]
    assert {"sizes", "third"} <= set(found.tables) and "second" not in found.tables
    assert [part.verdict for part in found.parts] == [REFUTED, NOT_COMPUTED]


def test_a_table_made_before_is_not_made_again():
    calls = []
    checks = (
        a_check(cases=("a",)),
        a_check("second", cases=lambda study: calls.append("a") or ("a",)),
    )
    topic = Topic(
        key="topic",
        title="Topic",
        question="?",
        checks=checks,
    )
    given = lambda *_: None  # noqa: E731
    known = topic.measure(checks[1:], given, "quick", given, [])
    assert topic(given, "quick", given, known) == topic(given, "quick", given) and calls == [
        "a",
        "a",
    ]


def test_columns_follow_from_the_rows_and_have_their_marks():
    check = a_check(columns=Columns(timed=("size [m]",)), holds=None)
    table = check.table_of([{"case": "a", "holds": True}, {"size [m]": 2.0, "case": "b"}])
    assert table.columns == (Column("case"), Column("size", "m"))
    assert table.timed == ("size [m]", "holds")


def test_a_row_may_have_its_own_outcome():
    check = a_check(holds=None)
    table = check.table_of([{"case": "a", "holds": True}, {"case": "b"}])
    assert table.holds == (True, None) and table.keys == ["case"]
    assert (
        check.table_of([{"case": "a"}]).holds == ()
        and check.judge(check.table_of([{"case": "a"}])) == ()
    )


def test_one_row_that_fails_refutes_a_topic():
    check = a_check()
    (part,) = check.judge(
        check.table_of([{"case": "a", "size [m]": 1}, {"case": "cccc", "size [m]": 4}])
    )
    assert part.verdict == REFUTED and not part.timed


def test_a_missed_target_of_a_check_refutes_its_topic():
    targets = lambda table: [Part.on("longest", max(table["size"]), 1)]  # noqa: E731
    assert concluded(a_check(cases=("a",), targets=targets)).verdict == REPRODUCED
    assert concluded(a_check(cases=("a", "bb"), targets=targets)).verdict == REFUTED


def test_several_rows_of_a_case_and_shared_results():
    calls = []
    study = Study()
    check = Check(
        key="rows",
        question="",
        cases=lambda study: (1, 2),
        row=lambda study, n: [
            {"n": study.once("sum", lambda: calls.append(n) or 5) + k} for k in range(n)
        ],
    )
    assert check.table(study).rows == ((5,), (5,), (6,)) and calls == [1]
    with pytest.raises(ArgumentError, match="depth"):
        Study(depth="deep")
